//! Other starts, for guesses that are turned too far for projection to find partners.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::error::Result;
use crate::partners::pairs::Rules;
use crate::partners::sums::agreement;
use crate::partners::track::{Frames, Track};
use crate::preparation::blocks::Block;
use crate::preparation::grid::BLOCK;
use crate::registration::aligner::{COARSE_ITERATIONS, FrameAligner};

/// Distance within which points agree with target planes after the first level, in units of the radius.
const AGREEMENT_TOLERANCE: f64 = 0.03;
/// Share of the points in sight that have to agree for the first start to be the last.
const ENOUGH_AGREEMENT: f64 = 0.7;
/// Share of all points that has to be in sight.
const FEWEST_IN_SIGHT: f64 = 0.25;
/// Angle of the other starts.
pub(crate) const TURN_RAD: f64 = 0.26;
/// Their axes in the source's frame.
pub(crate) const TURNS: [[f64; 3]; 14] = [
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

impl FrameAligner {
    /// Passes the first level from the guess and, where the frames contradict each other after that, from starts turned
    /// away from it; the best goes on.
    pub(crate) fn start(&mut self, track: &Track, frames: Frames<'_>, blocks: &[Block]) -> Result<Track> {
        let guess = track.pose;
        let mut best = self.attempt(track.clone(), frames, blocks);
        for turn in TURNS.iter().take(self.options().other_starts) {
            if best.as_ref().is_ok_and(|(_, agreement)| *agreement >= ENOUGH_AGREEMENT) {
                break;
            }
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from(*turn) * TURN_RAD);
            // About the source's camera: where it stands is better known than where it looks.
            let pose = Isometry3::from_parts(guess.translation, guess.rotation * turn);
            let other = self.attempt(Track { pose, ..track.clone() }, frames, blocks);
            let agreement = |attempt: &Result<(Track, f64)>| attempt.as_ref().map_or(-1.0, |(_, a)| *a);
            if agreement(&other) > agreement(&best) {
                best = other;
            }
        }
        best.map(|(track, _)| track)
    }

    /// The track after the first level, and how far the frames agree there.
    fn attempt(&mut self, mut track: Track, frames: Frames<'_>, blocks: &[Block]) -> Result<(Track, f64)> {
        self.open(&mut track, frames, blocks)?;
        self.descend(&mut track, frames, blocks, COARSE_ITERATIONS)?;
        let agreement = share_of_agreement(&track, frames, blocks);
        Ok((track, agreement))
    }
}

/// Share of the points in sight of the target's planes that lie near them.
fn share_of_agreement(track: &Track, frames: Frames<'_>, blocks: &[Block]) -> f64 {
    let (moved, frame) = frames.moved(track);
    let tolerance = (AGREEMENT_TOLERANCE * frame.radius_m) as f32;
    let rules = Rules { extra_variance: tolerance * tolerance, reach: 1.0 };
    let (met, accepted) = agreement(&moved.by(rules), blocks);
    // Few points in sight agree easily.
    let needed = FEWEST_IN_SIGHT * (blocks.len() * BLOCK) as f64;
    accepted as f64 / (met as f64).max(needed)
}
