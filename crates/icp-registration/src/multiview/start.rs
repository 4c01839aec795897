//! From what is known beforehand to poses that are right to some centimetres.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Matrix6, Vector6};

use super::loops::{LoopClosure, contradicting, skeleton};
use super::overlap::find_overlaps;
use super::pose_graph::{Datum, PairConstraint, StationAdjustmentOptions, adjust_stations};
use super::registration::{Start, StationRegistrationOptions};
use super::surfaces::{PairAlignment, RefusedPair, align_pair, best_partners, sorted_out};
use crate::error::{Error, Result};
use crate::icp::{IcpOptions, IcpResult, IcpTarget};
use rayon::prelude::*;

/// Default of the error of approximate poses, in radii of the clouds.
const START_ERROR: f64 = 0.2;
/// Error of poses that came along a chain of pairs, in patches.
const CHAIN_ERROR: f64 = 3.0;
/// Default of the tolerance of loops, in radii of the clouds.
const LOOP_TOLERANCE: f64 = 0.1;
/// Fewest partners of a pair that is believed.
const FEWEST_PARTNERS: f64 = 0.1;

/// Poses with the pairs that they came from.
pub(super) struct Started {
    pub poses: Vec<Isometry3<f64>>,
    pub pairs: Vec<PairAlignment>,
    pub refused: Vec<RefusedPair>,
    pub loops: Vec<LoopClosure>,
}

/// The stations while their start values are looked for.
pub(super) struct Starter<'a> {
    /// Patches as clouds.
    pub targets: &'a [IcpTarget],
    pub options: &'a StationRegistrationOptions<'a>,
    pub patch_m: f64,
    pub radius_m: f64,
    pub datum: Datum,
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

/// A pair with the pose from which it is aligned.
type Guess = (usize, usize, Isometry3<f64>);

impl Starter<'_> {
    pub(super) fn run(
        &self,
        start: Start<'_>,
        coarse: &dyn Fn(&[(usize, usize)]) -> Vec<Result<Isometry3<f64>>>,
    ) -> Result<Started> {
        let count = self.targets.len();
        let root = self.datum.held_station();
        let (mut pairs, mut refused) = (Vec::new(), Vec::new());
        let mut reach_m = self.options.start_error_m.unwrap_or(START_ERROR * self.radius_m);
        let first = match start {
            Start::Poses(poses) => {
                let candidates = self.candidates(poses, reach_m)?;
                self.align(&guesses(poses, &candidates), reach_m, &mut pairs, &mut refused);
                poses[root]
            }
            Start::Order | Start::Nothing => {
                let candidates = blind_candidates(start, count);
                reach_m = CHAIN_ERROR * self.patch_m;
                let guesses = self.coarse_guesses(&candidates, coarse, &mut refused);
                self.align(&guesses, reach_m, &mut pairs, &mut refused);
                Isometry3::identity()
            }
        };
        let tolerance_m = self.options.loop_tolerance_m.unwrap_or(LOOP_TOLERANCE * self.radius_m);
        let poses = self.connected(&pairs, &refused, (root, first), tolerance_m)?;
        // Neighbours that nobody knew of: the ends of a round, and pairs that only better poses bring together.
        let tried: BTreeSet<(usize, usize)> = pairs.iter().map(|p| (p.target, p.source)).collect();
        let mut candidates = self.candidates(&poses, CHAIN_ERROR * self.patch_m)?;
        candidates.retain(|pair| !tried.contains(pair));
        refused.retain(|pair| !candidates.contains(&(pair.target, pair.source)));
        self.align(&guesses(&poses, &candidates), CHAIN_ERROR * self.patch_m, &mut pairs, &mut refused);
        pairs.sort_by_key(|pair| (pair.target, pair.source));
        let skeleton = skeleton(&pairs, (root, first), count, tolerance_m, self.radius_m);
        let poses = skeleton.poses.iter().zip(&poses).map(|(pose, before)| pose.unwrap_or(*before)).collect();
        let (sound, wrong) = split(pairs, &skeleton.sound);
        refused.extend(wrong.iter().map(contradicting));
        let poses = self.pose_graph(&sound, poses);
        Ok(Started { poses, pairs: sound, refused, loops: skeleton.loops })
    }

    /// Pairs among the best partners of either at these poses.
    fn candidates(&self, poses: &[Isometry3<f64>], reach_m: f64) -> Result<Vec<(usize, usize)>> {
        let overlaps = find_overlaps(self.targets, poses, reach_m.max(self.patch_m))?;
        let (least, partners) = (self.options.minimum_overlap, self.options.partners_per_station);
        Ok(best_partners(&overlaps, self.targets.len(), least, partners))
    }

    fn coarse_guesses(
        &self,
        candidates: &[(usize, usize)],
        coarse: &dyn Fn(&[(usize, usize)]) -> Vec<Result<Isometry3<f64>>>,
        refused: &mut Vec<RefusedPair>,
    ) -> Vec<Guess> {
        let mut guesses = Vec::new();
        for (&(target, source), found) in candidates.iter().zip(coarse(candidates)) {
            match found {
                Ok(pose) => guesses.push((target, source, pose)),
                Err(error) => refused.push(RefusedPair { target, source, reason: error.to_string() }),
            }
        }
        guesses
    }

    fn align(
        &self,
        guesses: &[Guess],
        reach_m: f64,
        pairs: &mut Vec<PairAlignment>,
        refused: &mut Vec<RefusedPair>,
    ) {
        let icp = IcpOptions {
            initial_correspondence_distance_m: Some(reach_m.max(2.0 * self.patch_m)),
            max_correspondence_distance_m: Some(1.25 * self.patch_m),
            step_tolerance_m: Some(1e-3 * self.patch_m),
            ..IcpOptions::default()
        };
        let finished = std::sync::atomic::AtomicUsize::new(0);
        let align = |(target, source, guess): &Guess| {
            let result = align_pair(self.targets, *target, *source, guess, &icp);
            (self.progress)(finished.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, guesses.len());
            result
        };
        let results: Vec<Result<IcpResult>> = guesses.par_iter().map(align).collect();
        let named: Vec<(usize, usize)> = guesses.iter().map(|(target, source, _)| (*target, *source)).collect();
        let (aligned, failed) = sorted_out(&named, results);
        refused.extend(failed);
        for pair in aligned {
            if pair.result.overlap >= FEWEST_PARTNERS {
                pairs.push(pair);
            } else {
                refused.push(super::surfaces::without_partners(&pair));
            }
        }
    }

    /// Poses along the pairs that hold together, or the stations that none leads to.
    fn connected(
        &self,
        pairs: &[PairAlignment],
        refused: &[RefusedPair],
        root: (usize, Isometry3<f64>),
        tolerance_m: f64,
    ) -> Result<Vec<Isometry3<f64>>> {
        let poses = skeleton(pairs, root, self.targets.len(), tolerance_m, self.radius_m).poses;
        let stations: Vec<usize> = (0..poses.len()).filter(|&station| poses[station].is_none()).collect();
        if stations.is_empty() {
            return Ok(poses.into_iter().flatten().collect());
        }
        let touching = refused.iter().filter(|p| stations.contains(&p.target) || stations.contains(&p.source));
        let reasons = touching.map(|p| format!("{} to {}: {}", p.source, p.target, p.reason)).collect();
        Err(Error::UnconnectedStations { stations, to: root.0, reasons })
    }

    /// The pairs adjusted by themselves; where that fails, the tree is good enough.
    fn pose_graph(&self, pairs: &[PairAlignment], poses: Vec<Isometry3<f64>>) -> Vec<Isometry3<f64>> {
        let constraints = constraints(pairs, 0.2 * self.patch_m, self.radius_m);
        let held = Datum::Station(self.datum.held_station());
        match adjust_stations(&constraints, &poses, held, &StationAdjustmentOptions::default()) {
            Ok(adjusted) => adjusted.world_from_station,
            Err(_) => poses,
        }
    }
}

/// The pairs as observations. A pair aligned by itself is not known better than `floor_m`: covariances of thin overlaps
/// tell of the noise in them and not of the partners that they miss. What it leaves open has a wide variance.
fn constraints(pairs: &[PairAlignment], floor_m: f64, radius_m: f64) -> Vec<PairConstraint> {
    let diagonal = |length: f64| Vector6::from_fn(|row, _| (length / if row < 3 { 1.0 } else { radius_m }).powi(2));
    let floor = Matrix6::from_diagonal(&diagonal(floor_m));
    let wide = Matrix6::from_diagonal(&diagonal(radius_m).map(|v| 1.0 / v));
    let covariance = |pair: &PairAlignment| {
        let information = (pair.result.covariance + floor).try_inverse().unwrap_or_else(Matrix6::zeros) + wide;
        information.try_inverse().map_or(floor, |c| 0.5 * (c + c.transpose()))
    };
    let constraint = |pair: &PairAlignment| PairConstraint {
        target: pair.target,
        source: pair.source,
        target_from_source: pair.result.target_from_source,
        covariance: covariance(pair),
    };
    pairs.iter().map(constraint).collect()
}

fn guesses(poses: &[Isometry3<f64>], candidates: &[(usize, usize)]) -> Vec<Guess> {
    candidates.iter().map(|&(target, source)| (target, source, poses[target].inverse() * poses[source])).collect()
}

/// Pairs to be aligned without poses: the next two stations of each, and first with last; or all.
fn blind_candidates(start: Start<'_>, count: usize) -> Vec<(usize, usize)> {
    let wanted = |target: usize, source: usize| match start {
        Start::Nothing => true,
        _ => source - target <= 2 || (target == 0 && source + 1 == count),
    };
    (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).filter(|&(t, s)| wanted(t, s)).collect()
}

fn split(pairs: Vec<PairAlignment>, sound: &[bool]) -> (Vec<PairAlignment>, Vec<PairAlignment>) {
    let (sound, wrong): (Vec<_>, Vec<_>) = pairs.into_iter().zip(sound).partition(|(_, sound)| **sound);
    (sound.into_iter().map(|(pair, _)| pair).collect(), wrong.into_iter().map(|(pair, _)| pair).collect())
}
