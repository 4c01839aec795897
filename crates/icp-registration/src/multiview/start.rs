//! Pairs of stations by themselves at the adjusted poses: how loops close, and which pairs contradict them.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Isometry3;
use rayon::prelude::*;

use super::contacts::Reach;
use super::loops::{LoopClosure, Skeleton, contradicting, skeleton};
use super::overlap::Overlap;
use super::pairs;
use super::patches::Surface;
use super::pose_graph::Datum;
use super::reduction::Meeting;
use super::registration::StationRegistrationOptions;
use super::rounds::meet;
use super::surfaces::{PairAlignment, RefusedPair, best_partners, sorted_out, without_partners};
use crate::error::Result;
use crate::icp::IcpResult;

/// Default of the tolerance of loops, in radii of the clouds.
const LOOP_TOLERANCE: f64 = 0.1;
/// Fewest partners of a pair that is believed.
const FEWEST_PARTNERS: f64 = 0.1;

/// Poses that the stations had at first, with the pairs at the adjusted ones.
pub(super) struct Started {
    pub poses: Vec<Isometry3<f64>>,
    pub pairs: Vec<PairAlignment>,
    pub refused: Vec<RefusedPair>,
    pub loops: Vec<LoopClosure>,
}

/// The stations whose pairs are looked at.
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
}

fn guesses(poses: &[Isometry3<f64>], candidates: &[(usize, usize)]) -> Vec<Guess> {
    candidates.iter().map(|&(target, source)| (target, source, poses[target].inverse() * poses[source])).collect()
}

fn split(pairs: Vec<PairAlignment>, sound: &[bool]) -> (Vec<PairAlignment>, Vec<PairAlignment>) {
    let (sound, wrong): (Vec<_>, Vec<_>) = pairs.into_iter().zip(sound).partition(|(_, sound)| **sound);
    (sound.into_iter().map(|(pair, _)| pair).collect(), wrong.into_iter().map(|(pair, _)| pair).collect())
}
