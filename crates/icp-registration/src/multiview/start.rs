//! From what is known beforehand to poses that are right to some centimetres.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{Isometry3, Matrix6, Vector6};
use rayon::prelude::*;

use super::contacts::Reach;
use super::loops::{LoopClosure, Skeleton, contradicting, skeleton};
use super::overlap::Overlap;
use super::pairs;
use super::patches::Surface;
use super::pose_graph::{Datum, PairConstraint, StationAdjustmentOptions, adjust_stations};
use super::reduction::Meeting;
use super::registration::{Start, StationRegistrationOptions};
use super::rounds::meet;
use super::surfaces::{PairAlignment, RefusedPair, best_partners, sorted_out, without_partners};
use crate::error::{Error, Result};
use crate::icp::IcpResult;

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
    pub surfaces: &'a [Surface],
    pub options: &'a StationRegistrationOptions<'a>,
    pub patch_m: f64,
    pub radius_m: f64,
    pub datum: Datum,
    pub progress: &'a (dyn Fn(usize, usize) + Sync),
}

/// A pair with the pose from which it is aligned.
type Guess = (usize, usize, Isometry3<f64>);

impl Starter<'_> {
    /// How far start poses may be off, metre.
    pub(super) fn reach_m(&self, start: Start<'_>) -> f64 {
        match start {
            Start::Poses(_) => self.options.start_error_m.unwrap_or(START_ERROR * self.radius_m),
            _ => CHAIN_ERROR * self.patch_m,
        }
    }

    /// Poses of stations of which at most the order is known, from pairs.
    pub(super) fn without_poses(
        &self,
        start: Start<'_>,
        coarse: &dyn Fn(&[(usize, usize)]) -> Vec<Result<Isometry3<f64>>>,
    ) -> Result<Started> {
        let candidates = blind_candidates(start, self.surfaces.len());
        let mut refused = Vec::new();
        let guesses = self.coarse_guesses(&candidates, coarse, &mut refused);
        let pairs = self.align(&guesses, CHAIN_ERROR * self.patch_m, &mut refused);
        let skeleton = self.skeleton(&pairs, Isometry3::identity());
        let poses = self.connected(skeleton.poses, &refused)?;
        let (sound, wrong) = split(pairs, &skeleton.sound);
        refused.extend(wrong.iter().map(contradicting));
        Ok(Started { poses: self.pose_graph(&sound, poses), pairs: sound, refused, loops: skeleton.loops })
    }

    /// Pairs aligned by themselves at poses that are right, which show how loops close.
    pub(super) fn check(&self, poses: &[Isometry3<f64>]) -> Result<Started> {
        let candidates = self.candidates(poses)?;
        let mut refused = Vec::new();
        let pairs = self.align(&guesses(poses, &candidates), self.patch_m, &mut refused);
        let skeleton = self.skeleton(&pairs, poses[self.datum.held_station()]);
        let (sound, wrong) = split(pairs, &skeleton.sound);
        refused.extend(wrong.iter().map(contradicting));
        Ok(Started { poses: poses.to_vec(), pairs: sound, refused, loops: skeleton.loops })
    }

    fn skeleton(&self, pairs: &[PairAlignment], first: Isometry3<f64>) -> Skeleton {
        let tolerance_m = self.options.loop_tolerance_m.unwrap_or(LOOP_TOLERANCE * self.radius_m);
        let root = (self.datum.held_station(), first);
        skeleton(pairs, root, self.surfaces.len(), tolerance_m, self.radius_m)
    }

    /// Pairs among the best partners of either at these poses.
    fn candidates(&self, poses: &[Isometry3<f64>]) -> Result<Vec<(usize, usize)>> {
        let count = poses.len();
        let all: Vec<(usize, usize)> = (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).collect();
        let surfaces: Vec<&Surface> = self.surfaces.iter().collect();
        let reach = Reach { across_m: self.patch_m, candidates: 1 };
        let meetings = meet(&surfaces, poses, &all, reach, self.options.minimum_contacts)?;
        let overlap = |meeting: &Meeting| {
            let asked = meeting.contacts.iter().filter(|contact| contact.asked_by_source).count();
            let fraction = asked as f64 / self.surfaces[meeting.source].patches.len() as f64;
            Overlap { source: meeting.source, target: meeting.target, fraction }
        };
        let overlaps: Vec<Overlap> = meetings.iter().map(overlap).collect();
        let (least, partners) = (self.options.minimum_overlap, self.options.partners_per_station);
        Ok(best_partners(&overlaps, count, least, partners))
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

    fn align(&self, guesses: &[Guess], reach_m: f64, refused: &mut Vec<RefusedPair>) -> Vec<PairAlignment> {
        let finished = AtomicUsize::new(0);
        let align = |(target, source, guess): &Guess| {
            let (target, source) = (&self.surfaces[*target], &self.surfaces[*source]);
            let result = pairs::align(source, target, guess, reach_m, self.options.minimum_contacts);
            (self.progress)(finished.fetch_add(1, Ordering::Relaxed) + 1, guesses.len());
            result
        };
        let results: Vec<Result<IcpResult>> = guesses.par_iter().map(align).collect();
        let named: Vec<(usize, usize)> = guesses.iter().map(|(target, source, _)| (*target, *source)).collect();
        let (aligned, failed) = sorted_out(&named, results);
        refused.extend(failed);
        let (enough, thin): (Vec<_>, Vec<_>) = aligned.into_iter().partition(|p| p.result.overlap >= FEWEST_PARTNERS);
        refused.extend(thin.iter().map(without_partners));
        enough
    }

    /// All poses, or the stations that no pair leads to.
    fn connected(&self, poses: Vec<Option<Isometry3<f64>>>, refused: &[RefusedPair]) -> Result<Vec<Isometry3<f64>>> {
        let stations: Vec<usize> = (0..poses.len()).filter(|&station| poses[station].is_none()).collect();
        if stations.is_empty() {
            return Ok(poses.into_iter().flatten().collect());
        }
        let touching = refused.iter().filter(|p| stations.contains(&p.target) || stations.contains(&p.source));
        let reasons = touching.map(|p| format!("{} to {}: {}", p.source, p.target, p.reason)).collect();
        Err(Error::UnconnectedStations { stations, to: self.datum.held_station(), reasons })
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
