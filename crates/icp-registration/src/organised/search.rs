//! A search around the guess, for frames that contradict each other, or leave a motion open, where the normal course
//! has ended.

use nalgebra::Isometry3;
use rayon::prelude::*;

use super::aligner::FrameAligner;
use super::consistency::{DOUBT_LEVEL, FrameConsistency, consistency};
use super::crossing::Crossing;
use super::frame::OrganisedFrame;
use super::places::Places;
use super::track::Track;
use crate::error::Result;
use crate::icp::{IcpResult, MotionKind, StopReason};

/// Share of the compared nodes that contradict, and of those that are hidden, above which a pose is doubted.
const MOST_WRONG: f64 = 0.02;
const MOST_HIDDEN: f64 = 0.08;
/// Share of all nodes that have to agree.
const LEAST_AGREEING: f64 = 0.3;
/// Distances of agreement while poses are still coarse and when they are fine, in units of the radius.
pub(super) const COARSE_TOLERANCE: f64 = 0.04;
const FINE_TOLERANCE: f64 = 0.012;
/// Level on which fine poses are compared: every second node.
const FINE_LEVEL: usize = 2;
/// How much the share of contradicting or unclear nodes takes from what agrees, and what a hidden node counts beside one
/// of these.
const CONTRADICTION: f64 = 50.0;
const HIDDEN: f64 = 0.3;
/// What another place must gain: sliding along a wall changes the overlap by percents.
const LEAST_GAIN: f64 = 1.03;
/// What it may lose where the nodes that tell the open motions speak for it, and what these must gain: a share, and some
/// nodes.
const MOST_LOST: f64 = 0.95;
const TELLING_GAIN: f64 = 0.15;
const FEWEST_TELLING: f64 = 8.0;

impl FrameAligner {
    /// The result that most speaks for, where `first` can be doubted.
    pub(super) fn searched(
        &mut self,
        first: Result<(Track, IcpResult)>,
        start: &Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
    ) -> Result<IcpResult> {
        let mut best = first;
        if !best.as_ref().is_ok_and(|(_, result)| agrees(source, target, result)) {
            let places = self.look_around(start, source, target);
            best = self.best_of(best, &places, start, source, target);
        }
        if let Ok((track, result)) = &best
            && result.degenerate.iter().any(|motion| motion.kind == MotionKind::Translation)
            && agrees(source, target, result)
        {
            let crossing = Crossing::new(source, target, &result.target_from_source, &result.degenerate);
            let places = Places::along(track, &result.degenerate, &crossing, source.points.radius_m);
            best = self.best_of(best, &places, start, source, target);
        }
        best.map(|best| {
            let is_open = !best.1.degenerate.is_empty();
            let best = if is_open { self.placed_by_outlines(best, source, target, &start.pose) } else { best };
            let mut result = best.1;
            if result.stop != StopReason::MaxIterations && !agrees(source, target, &result) {
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
        start: &Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
    ) -> Result<(Track, IcpResult)> {
        let crossing = best
            .as_ref()
            .ok()
            .map(|(_, result)| Crossing::new(source, target, &result.target_from_source, &result.degenerate));
        let merit = |pose: &Isometry3<f64>| Merit::new(source, target, crossing.as_ref(), pose);
        let places: Vec<&Track> = places.all().collect();
        // Each place on an aligner of its own: what comes out does not hang on the threads.
        let approached = places.into_par_iter().map_with(self.clone(), |aligner, place| {
            let mut track = place.clone();
            aligner.approach(&mut track, source, target).ok().map(|()| (merit(&track.pose), track))
        });
        let approached: Vec<Option<(Merit, Track)>> = approached.collect();
        let most = best.as_ref().map_or(Merit::default(), |(_, result)| merit(&result.target_from_source));
        let mut chosen: Option<(Merit, Track)> = None;
        for (gained, track) in approached.into_iter().flatten() {
            if gained.beats(&chosen.as_ref().map_or(most, |(merit, _)| *merit)) {
                chosen = Some((gained, track));
            }
        }
        let Some((_, track)) = chosen else { return best };
        match self.end(track, source, target, &start.pose, self.hold()) {
            Ok(other) if merit(&other.1.target_from_source).beats(&most) => Ok(other),
            _ => best,
        }
    }
}

/// What speaks for a fine pose.
#[derive(Debug, Clone, Copy, Default)]
struct Merit {
    /// All nodes.
    evidence: f64,
    /// Those that tell the motions that were open.
    telling: f64,
}

impl Merit {
    fn new(
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        crossing: Option<&Crossing<'_>>,
        pose: &Isometry3<f64>,
    ) -> Self {
        let tolerance = FINE_TOLERANCE * source.points.radius_m;
        Self {
            evidence: weighed(&consistency(source, target, pose, FINE_LEVEL, tolerance)),
            telling: crossing.map_or(0.0, |crossing| crossing.agreement(pose, tolerance)),
        }
    }

    fn beats(&self, other: &Self) -> bool {
        let enough = other.telling + TELLING_GAIN * other.telling.abs() + FEWEST_TELLING;
        self.evidence > LEAST_GAIN * other.evidence
            || self.evidence > MOST_LOST * other.evidence && self.telling > enough
    }
}

/// Whether frames at a pose share enough, and hardly contradict each other. On uneven surfaces nodes lie near planes with
/// another normal at right poses too: as often as within each frame.
fn agrees(source: &OrganisedFrame, target: &OrganisedFrame, result: &IcpResult) -> bool {
    let tolerance = COARSE_TOLERANCE * source.points.radius_m;
    let counts = consistency(source, target, &result.target_from_source, DOUBT_LEVEL, tolerance);
    let (compared, hidden) = (counts.compared() as f64, counts.hidden as f64);
    let beside = |unclear: f64| counts.contradicting as f64 + unclear <= MOST_WRONG * compared;
    let expected = || 0.5 * compared * (source.unevenness(tolerance) + target.unevenness(tolerance));
    (beside(counts.unclear as f64) || beside((counts.unclear as f64 - expected()).max(0.0)))
        && hidden <= MOST_HIDDEN * (compared + hidden)
        && counts.agreeing as f64 >= LEAST_AGREEING * counts.all() as f64
}

/// Agreeing nodes, less the more the frames contradict each other. A share and no sum: on real frames some contradiction
/// is everywhere, and a large overlap must not pay for it.
pub(super) fn weighed(counts: &FrameConsistency) -> f64 {
    let wrong = (counts.contradicting + counts.unclear) as f64 + HIDDEN * counts.hidden as f64;
    let agreeing = counts.agreeing as f64;
    agreeing / (1.0 + CONTRADICTION * wrong / (agreeing + wrong).max(1.0))
}
