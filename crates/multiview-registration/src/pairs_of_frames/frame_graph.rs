//! The poses of all frames from the pairs that can be trusted: one graph, without pairs that contradict it.
//!
//! Pairs have the weights of their random errors. Those of the sensor's shared error grow with the motion, and would leave all
//! to neighbours, each of which that error pulls towards no motion: of 12 frames of a Kinect 10 apart the farthest is then 45 mm
//! off instead of 24. They are in the gates and in the covariances of the poses.

use nalgebra::{Isometry3, Matrix6};

use crate::agreement::alignments::PairAlignment;
use crate::agreement::loops::{LoopClosure, SpanningTree, spanning_tree};
use crate::pairs_of_frames::frame_pairs::FramePair;
use crate::pairs_of_frames::frames::ROUNDS;
use icp_registration::IcpResult;
use pose_graph::{Edge, Graph, Relation};
use projective_registration::{FieldMatrix, SharedError};
use rigid_pose::Uncertain;

/// Poses of the frames that pairs connect.
pub(crate) struct FrameGraph {
    graph: Graph,
    /// The frame of each pose of the graph; the first one is the datum.
    pub members: Vec<usize>,
    /// Whether each pair fits.
    pub fits: Vec<bool>,
    pub loops: Vec<LoopClosure>,
    /// Covariance of the field of the shared error.
    shared: FieldMatrix,
}

impl FrameGraph {
    /// The largest part of the frames that pairs connect.
    pub(crate) fn new(count: usize, pairs: &[FramePair], shared: &SharedError) -> Self {
        let alignments: Vec<PairAlignment> = pairs.iter().map(|pair| pair.with_shared(shared)).collect();
        let (members, spanning_tree) = largest_part(count, &alignments);
        let graph = Graph::at(Isometry3::identity());
        let mut found = Self {
            graph,
            members,
            fits: vec![false; pairs.len()],
            loops: spanning_tree.loops,
            shared: shared.of_field(),
        };
        found.grow(pairs, &spanning_tree.tree);
        found.settle(pairs);
        found
    }

    pub(crate) fn index(&self, frame: usize) -> Option<usize> {
        self.members.iter().position(|member| *member == frame)
    }

    /// `a_from_b` of two frames that are placed.
    pub fn relative(&self, a: usize, b: usize) -> Option<Isometry3<f64>> {
        Some(self.graph.relative(self.index(a)?, self.index(b)?))
    }

    /// Pose in the frame of the datum, with its covariance.
    pub fn pose(&self, frame: usize) -> Option<(Isometry3<f64>, Matrix6<f64>)> {
        let total = self.graph.poses[self.index(frame)?].total(&self.shared);
        Some((total.pose, total.covariance))
    }

    /// By how much pairs scatter beyond their covariances, as a factor of these.
    pub fn factor(&self) -> f64 {
        self.graph.factor
    }

    /// Poses along the tree.
    fn grow(&mut self, pairs: &[FramePair], tree: &[usize]) {
        self.members.truncate(1);
        for &k in tree {
            let PairAlignment { target, source, .. } = pairs[k].alignment;
            let a_from_b = relation(&pairs[k]);
            let (from, to, step) = match self.index(target) {
                Some(from) => (from, source, a_from_b),
                None => (self.index(source).unwrap_or(0), target, a_from_b.inverse()),
            };
            self.graph.add(from, &step);
            self.members.push(to);
            self.fits[k] = true;
        }
    }

    /// Adjusts the poses with all pairs that fit.
    fn settle(&mut self, pairs: &[FramePair]) {
        let edge = |pair: &FramePair| {
            let (a, b) = (self.index(pair.alignment.target)?, self.index(pair.alignment.source)?);
            Some(Edge { a, b, a_from_b: relation(pair), alike: 1.0 })
        };
        let edges: Vec<Option<Edge>> = pairs.iter().map(edge).collect();
        for _ in 0..ROUNDS {
            self.graph.covariance = self.shared;
            let fits: Vec<bool> =
                edges.iter().map(|edge| edge.as_ref().is_some_and(|edge| self.graph.fits(edge))).collect();
            if self.graph.closed && fits == self.fits {
                break;
            }
            self.fits = fits;
            let chosen = edges.iter().zip(&self.fits).filter(|(_, fits)| **fits).filter_map(|(edge, _)| *edge);
            self.graph.edges.clear();
            self.graph.take(counted(&chosen.collect::<Vec<_>>()));
            self.graph.adjust_if_closed();
        }
    }
}

/// Half of the errors of a registration are those of either frame, which all registrations of that frame share.
fn counted(edges: &[Edge]) -> Vec<Edge> {
    let of = |pose: usize| edges.iter().filter(|edge| edge.a == pose || edge.b == pose).count() as f64;
    edges.iter().map(|edge| Edge { alike: of(edge.a).midpoint(of(edge.b)), ..*edge }).collect()
}

/// As an observation of a graph.
fn relation(pair: &FramePair) -> Relation {
    let IcpResult { target_from_source: pose, covariance, .. } = pair.alignment.result;
    Relation { random: Uncertain { pose, covariance }, by_field: -pair.influence.pose }
}

/// The frames of the largest part that pairs connect, its first frame first, and the tree from there.
fn largest_part(count: usize, pairs: &[PairAlignment]) -> (Vec<usize>, SpanningTree) {
    let mut best: Option<(Vec<usize>, SpanningTree)> = None;
    let mut seen = vec![false; count];
    for root in 0..count {
        if seen[root] {
            continue;
        }
        let found = spanning_tree(pairs, root, count);
        let mut members = vec![root];
        members.extend((0..count).filter(|&k| k != root && found.reaches(k)));
        for &k in &members {
            seen[k] = true;
        }
        if best.as_ref().is_none_or(|(most, _)| members.len() > most.len()) {
            best = Some((members, found));
        }
    }
    best.unwrap_or_default()
}
