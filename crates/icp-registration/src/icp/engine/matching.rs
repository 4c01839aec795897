//! Pairs at a given moment: partners found in parallel, and remembered while they cannot change.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use rigid_pose::{InputError, is_usable};

use crate::error::{Error, Result};
use crate::icp::engine::registration::Engine;
use crate::parts::{Moment, Pair, Partner, Query, Scene};
use crate::system::CHUNK;
use point_cloud::Cloud;

/// Displacement since the last matching, in spacings of the target, below which answers are worth remembering.
const SETTLING: f64 = 0.1;

/// Source points that are matched again and again.
pub(crate) struct Points {
    pub indices: Vec<usize>,
    /// The last answers.
    memory: Vec<Memory>,
    /// Whether answers are remembered: from the moment on at which the poses settle.
    remembers: bool,
    last_pose: Option<Isometry3<f64>>,
}

/// An answer, and for which place and limit it was given.
#[derive(Clone, Copy)]
struct Memory {
    partner: Partner,
    asked_at: Vector3<f64>,
    limit_m: f64,
}

impl Points {
    pub(crate) fn new(indices: Vec<usize>) -> Self {
        let nothing = Memory { partner: Partner::none(0.0), asked_at: Vector3::zeros(), limit_m: f64::NAN };
        Self { memory: vec![nothing; indices.len()], indices, remembers: false, last_pose: None }
    }

    /// Remembers answers from now on: the poses to come are near each other.
    pub(crate) fn remember(&mut self) {
        self.remembers = true;
    }

    /// Remembers answers once the poses have come near each other.
    fn remember_when_settling(&mut self, scene: &Scene<'_>) {
        let pose = scene.moment.pose;
        if let Some(last) = self.last_pose.replace(pose) {
            let n = self.indices.len();
            let some = [0, n / 3, 2 * n / 3, n.saturating_sub(1)].into_iter().filter_map(|k| self.indices.get(k));
            let moved = some.map(|&i| (pose * scene.source.points[i] - last * scene.source.points[i]).norm());
            if moved.fold(0.0, f64::max) <= SETTLING * scene.target.spacing_m {
                self.remember();
            }
        }
    }
}

impl Engine<'_> {
    /// Pairs of the points in their order that every part keeps one by one.
    pub(crate) fn gated_pairs(&self, scene: &Scene<'_>, points: &mut Points) -> Result<Vec<Pair>> {
        points.remember_when_settling(scene);
        let Points { indices, memory, remembers, .. } = points;
        let pairs = |(indices, memory): (&[usize], &mut [Memory])| {
            let mut pairs = Vec::with_capacity(indices.len());
            for (&i, memory) in indices.iter().zip(memory) {
                self.pair(scene, i, remembers.then_some(memory), &mut pairs)?;
            }
            Ok(pairs)
        };
        let chunks: Result<Vec<Vec<Pair>>> =
            indices.par_chunks(CHUNK).zip(memory.par_chunks_mut(CHUNK)).map(pairs).collect();
        Ok(chunks?.concat())
    }

    /// The pairs that are left when they are judged together, with their weights.
    pub(crate) fn judged(&self, scene: &Scene<'_>, mut pairs: Vec<Pair>) -> Vec<Pair> {
        for rejection in self.rejection {
            rejection.reject(scene, &mut pairs);
        }
        for weighting in &self.parts.weighting {
            weighting.weigh(scene, &mut pairs);
        }
        // NaN fails the comparison.
        pairs.retain(|pair| pair.weight > 0.0 && pair.weight < f64::INFINITY);
        pairs
    }

    /// Pairs at a moment, weighted, or the error that there are too few.
    pub(crate) fn pairs(&self, moment: &Moment, points: &mut Points, iterations: usize) -> Result<Vec<Pair>> {
        let scene = self.scene.at(*moment);
        let gated = self.gated_pairs(&scene, points)?;
        self.enough(&scene, gated, points, iterations)
    }

    /// Gated pairs judged and weighted, or the error that too few are left.
    pub(crate) fn enough(
        &self,
        scene: &Scene<'_>,
        gated: Vec<Pair>,
        points: &Points,
        iterations: usize,
    ) -> Result<Vec<Pair>> {
        let pairs = self.judged(scene, gated);
        let (found, of, needed) = (pairs.len(), points.indices.len(), self.parts.min_correspondences);
        if found < needed {
            let (max_distance_m, iteration) = (scene.moment.limit_m, iterations);
            return Err(InputError::TooFewCorrespondences { found, of, needed, max_distance_m, iteration }.into());
        }
        Ok(pairs)
    }

    /// Adds the pair of a source point where every part keeps it.
    #[inline]
    fn pair(&self, scene: &Scene<'_>, source: usize, memory: Option<&mut Memory>, to: &mut Vec<Pair>) -> Result<()> {
        let pose = scene.moment.pose;
        let moved = pose * scene.source.points[source];
        if !is_usable(&moved) {
            return Err(InputError::NonFinite { what: "source points in the target frame", index: source }.into());
        }
        let moved = moved.coords;
        let turned = pose.rotation * scene.source_normals[source];
        let limit_m = scene.moment.limit_m;
        let query = Query { source, moved, normal: turned, limit_m, remember: memory.is_some() };
        let partner = self.ask(&query, memory);
        if !partner.found {
            return Ok(());
        }
        if let Some(point) = partner.target {
            let count = scene.target.cloud.map_or(0, Cloud::len);
            if point >= count {
                return Err(Error::NoSuchPoint { part: "the matching", point, count });
            }
        }
        // NaN stays NaN either way.
        let source_normal = if turned.dot(&partner.normal) < 0.0 { -turned } else { turned };
        let pair = Pair {
            source,
            target: partner.target,
            moved,
            source_normal,
            point: partner.point,
            normal: partner.normal,
            distance_m: (moved - partner.point).norm(),
            weight: 1.0,
        };
        let kept = pair.distance_m <= scene.moment.limit_m
            && self.metric.accepts(scene, &pair)
            && self.rejection.iter().all(|rejection| rejection.keeps(scene, &pair));
        if kept {
            to.push(pair);
        }
        Ok(())
    }

    /// Asks for the partner, unless the point has moved too little since the last answer for it to change.
    fn ask(&self, query: &Query, memory: Option<&mut Memory>) -> Partner {
        let Some(memory) = memory else { return self.parts.matching.partner(query) };
        // A partner found stays the nearest whatever the limit; that there is none holds for its limit.
        let same_question = memory.partner.found || (memory.limit_m - query.limit_m).abs() <= 0.0;
        if !(same_question && (query.moved - memory.asked_at).norm() < memory.partner.margin_m) {
            let partner = self.parts.matching.partner(query);
            *memory = Memory { partner, asked_at: query.moved, limit_m: query.limit_m };
        }
        memory.partner
    }
}
