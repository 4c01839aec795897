//! Other starts, for guesses that are turned too far for projection to find partners.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::aligner::FrameAligner;
use super::blocks::Block;
use super::frame::OrganisedFrame;
use super::grid::BLOCK;
use super::pairs::Rules;
use super::sums::agreement;
use super::track::{Track, moved};
use crate::error::Result;
use crate::icp::{MotionKind, UndeterminedMotion};

/// Distance within which points agree with target planes after the first level, in units of the radius.
const AGREEMENT_TOLERANCE: f64 = 0.03;
/// Share of the points in sight that have to agree for the first start to be the last.
const ENOUGH_AGREEMENT: f64 = 0.7;
/// Share of all points that has to be in sight.
const FEWEST_IN_SIGHT: f64 = 0.25;
/// Angle of the other starts.
const TURN_RAD: f64 = 0.26;
/// Their axes in the source's frame.
const TURNS: [[f64; 3]; 14] = [
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [-1.0, -1.0, 0.0],
    [0.0, 1.0, 1.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, 1.0],
    [0.0, -1.0, -1.0],
];

/// Distance of the places that are tried along an undetermined translation, in units of the radius.
const SLIDE: f64 = 0.05;
/// Places on either side.
const SLIDES: usize = 8;
/// Agreement that another place must gain.
const LEAST_GAIN: f64 = 0.01;

impl FrameAligner {
    /// Passes the first level from the guess and, where the frames contradict each other after that, from starts turned
    /// away from it; the best goes on.
    pub(super) fn start(
        &mut self,
        track: &Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        blocks: &[Block],
    ) -> Result<Track> {
        let guess = track.pose;
        let mut best = self.attempt(track.clone(), source, target, blocks);
        for turn in TURNS.iter().take(self.options().other_starts) {
            if best.as_ref().is_ok_and(|(_, agreement)| *agreement >= ENOUGH_AGREEMENT) {
                break;
            }
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from(*turn) * TURN_RAD);
            // About the source's camera: where it stands is better known than where it looks.
            let pose = Isometry3::from_parts(guess.translation, guess.rotation * turn);
            let other = self.attempt(Track { pose, ..track.clone() }, source, target, blocks);
            let agreement = |attempt: &Result<(Track, f64)>| attempt.as_ref().map_or(-1.0, |(_, a)| *a);
            if agreement(&other) > agreement(&best) {
                best = other;
            }
        }
        best.map(|(track, _)| track)
    }

    /// The track after the first level, and how far the frames agree there.
    fn attempt(
        &mut self,
        mut track: Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        blocks: &[Block],
    ) -> Result<(Track, f64)> {
        self.open(&mut track, source, target, blocks)?;
        self.descend(&mut track, source, target, blocks)?;
        let agreement = share_of_agreement(&track, source, target, blocks);
        Ok((track, agreement))
    }
}

/// Where a translation is undetermined, what would tell it may lie out of reach: looks along it for the place at
/// which the frames agree best, and gives the track there, if there is a better one.
pub(super) fn slid(
    track: &Track,
    motions: &[UndeterminedMotion],
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    blocks: &[Block],
) -> Option<Track> {
    let (mut best, mut found) = (track.clone(), false);
    let mut most = share_of_agreement(track, source, target, blocks) + LEAST_GAIN;
    let slide = SLIDE * source.points.radius_m;
    for motion in motions.iter().filter(|m| m.kind == MotionKind::Translation) {
        let from = best.pose;
        for k in (1..=SLIDES).flat_map(|k| [k as f64, -(k as f64)]) {
            let place = from.translation.vector + motion.axis * (k * slide);
            let mut other = track.clone();
            other.pose = Isometry3::from_parts(place.into(), from.rotation);
            other.rules.extra_variance = (0.25 * slide * slide) as f32;
            let agreement = share_of_agreement(&other, source, target, blocks);
            if agreement > most {
                (most, best, found) = (agreement, other, true);
            }
        }
    }
    found.then_some(best)
}

/// Share of the points in sight of the target's planes that lie near them.
pub(super) fn share_of_agreement(
    track: &Track,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    blocks: &[Block],
) -> f64 {
    let (moved, gauge) = moved(track, source, target);
    let tolerance = (AGREEMENT_TOLERANCE * gauge.radius_m) as f32;
    let rules = Rules { extra_variance: tolerance * tolerance, reach: 1.0, ..track.rules };
    let (met, accepted) = agreement(&moved, &rules, blocks);
    // Few points in sight agree easily.
    let needed = FEWEST_IN_SIGHT * (blocks.len() * BLOCK) as f64;
    accepted as f64 / (met as f64).max(needed)
}
