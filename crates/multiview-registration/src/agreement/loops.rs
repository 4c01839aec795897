//! Loops of pairs: how they close, and the tree of the pairs that most of them confirm.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Vector6};

use crate::agreement::alignments::PairAlignment;
use pose_graph::is_likely;
use rigid_pose::Uncertain;
use rigid_pose::pose_difference;

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

/// The pair as the step from station `from`: `from_from_other`, and the other station.
fn step(pair: &PairAlignment, from: usize) -> (usize, Uncertain) {
    let step = Uncertain { pose: pair.result.target_from_source, covariance: pair.result.covariance };
    if pair.target == from { (pair.source, step) } else { (pair.target, step.inverse()) }
}

/// How far from coming back a way is.
fn closure(pairs: &[PairAlignment], first: usize, way: &[usize]) -> LoopClosure {
    let (mut at, mut total) = (first, Uncertain::exact(Isometry3::identity()));
    let mut stations = vec![first];
    for &pair in way {
        let (next, relative) = step(&pairs[pair], at);
        total = total.then(&relative);
        at = next;
        stations.push(next);
    }
    stations.pop();
    let v: Vector6<f64> = pose_difference(&Isometry3::identity(), &total.pose);
    let square = total.covariance.cholesky().map_or(f64::INFINITY, |factor| v.dot(&factor.solve(&v)));
    LoopClosure {
        stations,
        translation_m: v.fixed_rows::<3>(0).norm(),
        rotation_rad: v.fixed_rows::<3>(3).norm(),
        mahalanobis: square.max(0.0).sqrt(),
    }
}

/// The stations that pairs lead to from one.
pub(crate) fn reached(pairs: &[(usize, usize)], from: usize) -> BTreeSet<usize> {
    let mut beside: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for &(a, b) in pairs {
        beside.entry(a).or_default().push(b);
        beside.entry(b).or_default().push(a);
    }
    let (mut found, mut open) = (BTreeSet::from([from]), vec![from]);
    while let Some(at) = open.pop() {
        for &next in beside.get(&at).into_iter().flatten() {
            if found.insert(next) {
                open.push(next);
            }
        }
    }
    found
}

/// All triangles, as indices of pairs.
fn triangles(pairs: &[PairAlignment]) -> Vec<[usize; 3]> {
    let mut found = Vec::new();
    let mut numbers: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    let mut beside: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, pair) in pairs.iter().enumerate() {
        let (a, b) = (pair.target, pair.source);
        numbers.entry((a.min(b), a.max(b))).or_insert(index);
        for station in [a, b] {
            beside.entry(station).or_default().push(index);
        }
    }
    let between = |a: usize, b: usize| numbers.get(&(a.min(b), a.max(b))).copied();
    for (first, ab) in pairs.iter().enumerate() {
        let ends = [ab.target, ab.source].into_iter().filter_map(|station| beside.get(&station));
        let later: BTreeSet<usize> = ends.flatten().copied().filter(|second| *second > first).collect();
        for second in later {
            let cd = &pairs[second];
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
#[derive(Default)]
pub(crate) struct SpanningTree {
    /// The pairs of the tree, from its root outwards.
    pub tree: Vec<usize>,
    reached_by: Vec<Option<(usize, usize)>>,
    /// Triangles, and each pair outside the tree with the tree's way between its stations.
    pub loops: Vec<LoopClosure>,
}

impl SpanningTree {
    /// Whether the tree leads to a station, other than its root.
    pub(crate) fn reaches(&self, station: usize) -> bool {
        self.reached_by[station].is_some()
    }
}

/// The tree of the pairs that most triangles confirm, each at the 99.9 % level, from a station outwards, and how all loops close.
pub(crate) fn spanning_tree(pairs: &[PairAlignment], root: usize, stations: usize) -> SpanningTree {
    let mut votes = vec![0_i64; pairs.len()];
    let mut loops = Vec::new();
    for triangle in triangles(pairs) {
        let first = pairs[triangle[0]].target;
        let way = ordered(pairs, first, triangle);
        let closure = closure(pairs, first, &way);
        for pair in triangle {
            votes[pair] += if is_likely(closure.mahalanobis.powi(2)) { 1 } else { -1 };
        }
        loops.push(closure);
    }
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&a, &b| {
        // Confirmed pairs first, then those that determine all six unknowns, then those with the most overlap.
        let key = |k: usize| (votes[k].signum(), pairs[k].result.degenerate.is_empty(), votes[k]);
        key(b).cmp(&key(a)).then(pairs[b].result.overlap.total_cmp(&pairs[a].result.overlap)).then(a.cmp(&b))
    });
    let (mut reached_by, mut tree) = (vec![None; stations], Vec::new());
    let mut is_reached = vec![false; stations];
    is_reached[root] = true;
    while let Some(&next) = order.iter().find(|&&k| is_reached[pairs[k].target] != is_reached[pairs[k].source]) {
        let PairAlignment { target, source, .. } = pairs[next];
        let (from, to) = if is_reached[target] { (target, source) } else { (source, target) };
        is_reached[to] = true;
        reached_by[to] = Some((from, next));
        tree.push(next);
    }
    loops.extend(long_loops(pairs, &reached_by));
    SpanningTree { tree, reached_by, loops }
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
