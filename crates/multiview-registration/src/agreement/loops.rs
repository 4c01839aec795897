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

/// Which pair joins two stations, the smaller first.
type Between = BTreeMap<(usize, usize), usize>;

/// How far from coming back the way through these stations is.
fn closure(pairs: &[PairAlignment], between: &Between, stations: Vec<usize>) -> LoopClosure {
    let mut total = Uncertain::exact(Isometry3::identity());
    for (&from, &to) in stations.iter().zip(stations.iter().cycle().skip(1)) {
        let pair = &pairs[between[&(from.min(to), from.max(to))]];
        let step = Uncertain { pose: pair.result.target_from_source, covariance: pair.result.covariance };
        total = total.then(&if pair.target == from { step } else { step.inverse() });
    }
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

/// All triangles, as stations that each two of a pair join.
fn triangles(between: &Between) -> Vec<[usize; 3]> {
    let third = |&(a, b): &(usize, usize)| {
        let later = between.range((a, b + 1)..(a + 1, 0)).map(|((_, c), _)| *c);
        later.filter(move |c| between.contains_key(&(b, *c))).map(move |c| [a, b, c])
    };
    between.keys().flat_map(third).collect()
}

/// What the loops say about the pairs.
#[derive(Default)]
pub(crate) struct SpanningTree {
    /// The pairs of the tree, from its root outwards.
    pub tree: Vec<usize>,
    /// From which station each other is reached.
    reached_from: Vec<Option<usize>>,
    /// Triangles, and each pair outside the tree with the tree's way between its stations.
    pub loops: Vec<LoopClosure>,
}

impl SpanningTree {
    /// Whether the tree leads to a station, other than its root.
    pub(crate) fn reaches(&self, station: usize) -> bool {
        self.reached_from[station].is_some()
    }
}

/// The tree of the pairs that most triangles confirm, each at the 99.9 % level, from a station outwards, and how all loops close.
pub(crate) fn spanning_tree(pairs: &[PairAlignment], root: usize, stations: usize) -> SpanningTree {
    let joined = |(k, pair): (usize, &PairAlignment)| ((pair.target.min(pair.source), pair.target.max(pair.source)), k);
    let between: Between = pairs.iter().enumerate().map(joined).collect();
    let mut votes = vec![0_i64; pairs.len()];
    let mut loops = Vec::new();
    for [a, b, c] in triangles(&between) {
        let closure = closure(pairs, &between, vec![a, b, c]);
        for ends in [(a, b), (b, c), (a, c)] {
            votes[between[&ends]] += if is_likely(closure.mahalanobis.powi(2)) { 1 } else { -1 };
        }
        loops.push(closure);
    }
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&a, &b| {
        // Confirmed pairs first, then those that determine all six unknowns, then those with the most overlap.
        let key = |k: usize| (votes[k].signum(), pairs[k].result.degenerate.is_empty(), votes[k]);
        key(b).cmp(&key(a)).then(pairs[b].result.overlap.total_cmp(&pairs[a].result.overlap)).then(a.cmp(&b))
    });
    let (mut reached_from, mut tree) = (vec![None; stations], Vec::new());
    let mut is_reached = vec![false; stations];
    is_reached[root] = true;
    while let Some(&next) = order.iter().find(|&&k| is_reached[pairs[k].target] != is_reached[pairs[k].source]) {
        let PairAlignment { target, source, .. } = pairs[next];
        let (from, to) = if is_reached[target] { (target, source) } else { (source, target) };
        is_reached[to] = true;
        reached_from[to] = Some(from);
        tree.push(next);
    }
    let long = between.keys().filter_map(|ends| long_loop(*ends, &reached_from));
    loops.extend(long.map(|way| closure(pairs, &between, way)));
    SpanningTree { tree, reached_from, loops }
}

/// The tree's way between two stations that a pair outside it joins; triangles are left out.
fn long_loop((target, source): (usize, usize), reached_from: &[Option<usize>]) -> Option<Vec<usize>> {
    let to_root = |station| std::iter::successors(Some(station), |at: &usize| reached_from[*at]).collect();
    let (mut way, up): (Vec<usize>, Vec<usize>) = (to_root(source), to_root(target));
    let meet = way.iter().position(|station| up.contains(station))?;
    way.truncate(meet + 1);
    way.extend(up.iter().take_while(|station| **station != way[meet]).collect::<Vec<_>>().into_iter().rev());
    way.rotate_right(1);
    (way.len() > 3).then_some(way)
}
