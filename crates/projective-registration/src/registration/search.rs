//! A search around the guess, for frames that contradict each other, or leave a motion open, where the normal course
//! has ended.

use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::error::Result;
use crate::partners::map::Agreement;
use crate::partners::track::{Frames, Track};
use crate::registration::aligner::FrameAligner;
use crate::registration::consistency::{DOUBT_LEVEL, FrameConsistency, TOLERANCE, consistency};
use crate::registration::places::Places;
use icp_registration::{IcpResult, MotionKind, StopReason};

/// Share of the compared nodes that contradict, and of those that are hidden, above which a pose is doubted.
const MOST_WRONG: f64 = 0.02;
const MOST_HIDDEN: f64 = 0.08;
/// How much the share of contradicting, unclear or hidden nodes takes from what agrees.
const CONTRADICTION: f64 = 50.0;
/// What another place must gain: sliding along a wall changes the overlap by percents.
const LEAST_GAIN: f64 = 1.03;

impl FrameAligner {
    /// The result that most speaks for, where `first` can be doubted.
    pub(crate) fn searched(
        &mut self,
        first: Result<(Track, IcpResult)>,
        start: &Track,
        frames: Frames<'_>,
    ) -> Result<IcpResult> {
        let mut best = first;
        if !best.as_ref().is_ok_and(|(_, result)| agrees(frames, result)) {
            let places = self.look_around(start, frames);
            best = self.best_of(best, &places, frames);
        }
        if let Ok((track, result)) = &best
            && result.degenerate.iter().any(|motion| motion.kind == MotionKind::Translation)
            && agrees(frames, result)
        {
            let places = Places::along(track, &result.degenerate, frames);
            best = self.best_of(best, &places, frames);
        }
        best.map(|best| {
            let is_open = !best.1.degenerate.is_empty();
            let best = if is_open { self.placed_by_outlines(best, frames) } else { best };
            let mut result = best.1;
            if result.stop != StopReason::MaxIterations && !agrees(frames, &result) {
                result.stop = StopReason::Contradicted;
            }
            result
        })
    }

    /// Follows places to the end, or `best` where nothing speaks for another.
    fn best_of(
        &mut self,
        best: Result<(Track, IcpResult)>,
        places: &Places,
        frames: Frames<'_>,
    ) -> Result<(Track, IcpResult)> {
        let merit = |pose: &Isometry3<f64>| weighed(&compared(frames, pose));
        let places: Vec<&Track> = places.all().collect();
        // Each place on an aligner of its own: what comes out does not hang on the threads.
        let approached = places.into_par_iter().map_with(self.clone(), |aligner, place| {
            let mut track = place.clone();
            aligner.approach(&mut track, frames, frames.first_level() + 1).ok().map(|()| (merit(&track.pose), track))
        });
        let approached: Vec<Option<(f64, Track)>> = approached.collect();
        let most = best.as_ref().map_or(0.0, |(_, result)| merit(&result.target_from_source));
        let mut chosen: Option<(f64, Track)> = None;
        for (gained, track) in approached.into_iter().flatten() {
            if gained > LEAST_GAIN * chosen.as_ref().map_or(most, |(merit, _)| *merit) {
                chosen = Some((gained, track));
            }
        }
        let Some((_, track)) = chosen else { return best };
        match self.end(track, frames) {
            Ok(other) if merit(&other.1.target_from_source) > LEAST_GAIN * most => Ok(other),
            _ => best,
        }
    }
}

/// How frames agree at a pose, where it is to be judged.
fn compared(frames: Frames<'_>, pose: &Isometry3<f64>) -> FrameConsistency {
    consistency(frames, pose, DOUBT_LEVEL, TOLERANCE * frames.radius_m())
}

/// Whether frames at a pose share enough, and hardly contradict each other. On uneven surfaces nodes lie near planes with
/// another normal at right poses too: as often as within each frame.
fn agrees(frames: Frames<'_>, result: &IcpResult) -> bool {
    let counts = compared(frames, &result.target_from_source);
    let (compared, hidden) = (counts.compared() as f64, counts.hidden as f64);
    let beside = |unclear: f64| counts.contradicting as f64 + unclear <= MOST_WRONG * compared;
    let tolerance = TOLERANCE * frames.radius_m();
    let expected = || 0.5 * compared * (frames.source.unevenness(tolerance) + frames.target.unevenness(tolerance));
    (beside(counts.unclear as f64) || beside((counts.unclear as f64 - expected()).max(0.0)))
        && hidden <= MOST_HIDDEN * (compared + hidden)
        && counts.agreeing as f64 >= Agreement::LEAST_OVERLAP * counts.all() as f64
}

/// Agreeing nodes, less the more the frames contradict each other. A share and no sum: on real frames some contradiction
/// is everywhere, and a large overlap must not pay for it.
pub(crate) fn weighed(counts: &FrameConsistency) -> f64 {
    let (agreeing, wrong) = (counts.agreeing as f64, (counts.contradicting + counts.unclear + counts.hidden) as f64);
    agreeing / (1.0 + CONTRADICTION * wrong / (agreeing + wrong).max(1.0))
}
