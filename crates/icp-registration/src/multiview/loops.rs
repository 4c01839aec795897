//! Loops of pairs: how they close, and which pairs are wrong.

use nalgebra::{Isometry3, Matrix6, Vector6};

use super::alignments::{PairAlignment, RefusedPair};
use crate::pose::{inverse_covariance_transport, pose_difference, symmetrised};

/// A way from station to station and back.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopClosure {
    /// The stations in the order in which they are visited.
    pub stations: Vec<usize>,
    /// Distance by which the relative poses along the loop fail to come back, metre.
    pub translation_m: f64,
    /// Angle by which they fail, radian.
    pub rotation_rad: f64,
    /// The same in standard deviations (Mahalanobis, six components); beyond 4.1 in one of a hundred right loops, as
    /// far as the covariances of the pairs are right.
    pub mahalanobis: f64,
}

/// A relative pose with covariance.
type Relative = (Isometry3<f64>, Matrix6<f64>);

/// `a_from_c` from `a_from_b` and `b_from_c`.
fn chained(first: &Relative, second: &Relative) -> Relative {
    let (r1, r2) = (first.0.rotation.to_rotation_matrix().into_inner(), second.0.rotation.to_rotation_matrix());
    // t = t1 + R1 t2 and R = R1 R2: dt = dt1 - R1 [t2]x dtheta1 + R1 dt2, dtheta = R2^T dtheta1 + dtheta2.
    let (mut by_first, mut by_second) = (Matrix6::identity(), Matrix6::identity());
    by_first.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-r1 * second.0.translation.vector.cross_matrix()));
    by_first.fixed_view_mut::<3, 3>(3, 3).copy_from(&r2.into_inner().transpose());
    by_second.fixed_view_mut::<3, 3>(0, 0).copy_from(&r1);
    let covariance = by_first * first.1 * by_first.transpose() + by_second * second.1 * by_second.transpose();
    (first.0 * second.0, symmetrised(&covariance))
}

/// The pair as the step from station `from`: `from_from_other`, and the other station.
fn step(pair: &PairAlignment, from: usize) -> (usize, Relative) {
    let (pose, covariance) = (pair.result.target_from_source, pair.result.covariance);
    if pair.target == from {
        (pair.source, (pose, covariance))
    } else {
        (pair.target, (pose.inverse(), inverse_covariance_transport(&pose, &covariance)))
    }
}

fn closure(pairs: &[PairAlignment], first: usize, way: &[usize]) -> LoopClosure {
    let (mut at, mut total): (usize, Relative) = (first, (Isometry3::identity(), Matrix6::zeros()));
    let mut stations = vec![first];
    for &pair in way {
        let (next, relative) = step(&pairs[pair], at);
        total = chained(&total, &relative);
        at = next;
        stations.push(next);
    }
    stations.pop();
    let v: Vector6<f64> = pose_difference(&Isometry3::identity(), &total.0);
    let mahalanobis = total.1.cholesky().map_or(f64::INFINITY, |factor| v.dot(&factor.solve(&v)).max(0.0).sqrt());
    LoopClosure {
        stations,
        translation_m: v.fixed_rows::<3>(0).norm(),
        rotation_rad: v.fixed_rows::<3>(3).norm(),
        mahalanobis,
    }
}

/// All triangles, as indices of pairs.
fn triangles(pairs: &[PairAlignment]) -> Vec<[usize; 3]> {
    let mut found = Vec::new();
    let between = |a: usize, b: usize| {
        pairs.iter().position(|p| (p.target == a && p.source == b) || (p.target == b && p.source == a))
    };
    for (first, ab) in pairs.iter().enumerate() {
        for (second, cd) in pairs.iter().enumerate().skip(first + 1) {
            let shared = [cd.target, cd.source].into_iter().find(|s| *s == ab.target || *s == ab.source);
            let Some(shared) = shared else { continue };
            let a = if ab.target == shared { ab.source } else { ab.target };
            let b = if cd.target == shared { cd.source } else { cd.target };
            if let Some(third) = between(a, b).filter(|third| *third > second) {
                found.push([first, second, third]);
            }
        }
    }
    found
}

/// What the loops say about the pairs.
pub(super) struct Skeleton {
    /// For each pair whether the others agree with it.
    pub sound: Vec<bool>,
    /// Triangles, and each pair outside the tree with the tree's way between its stations.
    pub loops: Vec<LoopClosure>,
}

/// Which pairs agree with the tree of those that most loops confirm, and how the loops close.
///
/// `tolerance_m`: how far a loop may fail to close, rotations at `lever_m`; far above the error of a right pair and far
/// below that of a wrong one.
pub(super) fn skeleton(
    pairs: &[PairAlignment],
    root: (usize, Isometry3<f64>),
    stations: usize,
    tolerance_m: f64,
    lever_m: f64,
) -> Skeleton {
    let mut votes = vec![0_i64; pairs.len()];
    let mut loops = Vec::new();
    for triangle in triangles(pairs) {
        let first = pairs[triangle[0]].target;
        let way = ordered(pairs, first, triangle);
        let closure = closure(pairs, first, &way);
        let closes = closure.translation_m + lever_m * closure.rotation_rad <= tolerance_m;
        for pair in triangle {
            votes[pair] += if closes { 1 } else { -1 };
        }
        loops.push(closure);
    }
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&a, &b| {
        // Confirmed pairs first, then those that determine all six unknowns, then those with the most overlap.
        let key = |k: usize| (votes[k].signum(), pairs[k].result.degenerate.is_empty(), votes[k]);
        key(b).cmp(&key(a)).then(pairs[b].result.overlap.total_cmp(&pairs[a].result.overlap)).then(a.cmp(&b))
    });
    let mut poses = vec![None; stations];
    let mut reached_by = vec![None; stations];
    poses[root.0] = Some(root.1);
    while let Some(&next) =
        order.iter().find(|&&k| poses[pairs[k].target].is_some() != poses[pairs[k].source].is_some())
    {
        let pair = &pairs[next];
        let from = if poses[pair.target].is_some() { pair.target } else { pair.source };
        let (to, (relative, _)) = step(pair, from);
        poses[to] = poses[from].map(|pose: Isometry3<f64>| pose * relative);
        reached_by[to] = Some((from, next));
    }
    let sound = pairs.iter().map(|pair| match (poses[pair.target], poses[pair.source]) {
        (Some(target), Some(source)) => {
            let v = pose_difference(&(target.inverse() * source), &pair.result.target_from_source);
            v.fixed_rows::<3>(0).norm() + lever_m * v.fixed_rows::<3>(3).norm() <= tolerance_m
        }
        _ => false,
    });
    let sound = sound.collect();
    loops.extend(long_loops(pairs, &reached_by));
    Skeleton { sound, loops }
}

/// The three pairs in the order in which they lead from `first` back to it.
fn ordered(pairs: &[PairAlignment], first: usize, mut triangle: [usize; 3]) -> Vec<usize> {
    let mut at = first;
    for k in 0..3 {
        let touches = |pair: usize| pairs[pair].target == at || pairs[pair].source == at;
        if let Some(next) = (k..3).find(|&i| touches(triangle[i])) {
            triangle.swap(k, next);
            at = step(&pairs[triangle[k]], at).0;
        }
    }
    triangle.to_vec()
}

/// Each pair outside the tree, closed by the tree; triangles are left out.
fn long_loops(pairs: &[PairAlignment], reached_by: &[Option<(usize, usize)>]) -> Vec<LoopClosure> {
    let way_up = |mut station: usize| {
        let mut way = vec![(station, None)];
        while let Some((from, pair)) = reached_by[station] {
            way.push((from, Some(pair)));
            station = from;
        }
        way
    };
    let in_tree = |pair: usize| reached_by.iter().flatten().any(|(_, used)| *used == pair);
    let mut loops = Vec::new();
    for (index, pair) in pairs.iter().enumerate().filter(|(index, _)| !in_tree(*index)) {
        let (down, up) = (way_up(pair.source), way_up(pair.target));
        let meet = down.iter().position(|(station, _)| up.iter().any(|(other, _)| other == station));
        let Some(meet) = meet else { continue };
        let back = up.iter().position(|(station, _)| *station == down[meet].0).unwrap_or(0);
        let mut way = vec![index];
        way.extend(down[1..=meet].iter().filter_map(|(_, pair)| *pair));
        way.extend(up[1..=back].iter().rev().filter_map(|(_, pair)| *pair));
        if way.len() > 3 {
            loops.push(closure(pairs, pair.target, &way));
        }
    }
    loops
}

/// The pair as refused because of the others.
pub(super) fn contradicting(pair: &PairAlignment) -> RefusedPair {
    let reason = "contradicts the loops that the other pairs close".to_owned();
    RefusedPair { target: pair.target, source: pair.source, reason }
}
