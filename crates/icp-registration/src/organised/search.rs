//! A search around the guess, for frames that contradict each other, or leave a motion open, where the normal course
//! has ended.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::aligner::FrameAligner;
use super::consistency::{FrameConsistency, consistency};
use super::frame::OrganisedFrame;
use super::starts::{TURN_RAD, TURNS};
use super::track::{Track, blocks};
use crate::error::Result;
use crate::icp::{IcpResult, MotionKind, StopReason, UndeterminedMotion};

/// Level on which two frames are compared to see whether a pose can be doubted: every fourth node.
const DOUBT_LEVEL: usize = 1;
/// Share of the compared nodes that contradict or are unclear, and of those that are hidden, above which a pose is doubted.
const MOST_WRONG: f64 = 0.03;
const MOST_HIDDEN: f64 = 0.08;
/// Share of all nodes that have to agree.
const LEAST_AGREEING: f64 = 0.3;
/// Distances of agreement while poses are still coarse and when they are fine, in units of the radius.
const COARSE_TOLERANCE: f64 = 0.04;
const FINE_TOLERANCE: f64 = 0.012;
/// Level on which fine poses are compared: every second node.
const FINE_LEVEL: usize = 2;
/// How much the share of contradicting or unclear nodes takes from what agrees, and what a hidden node counts beside one
/// of these.
const CONTRADICTION: f64 = 50.0;
const HIDDEN: f64 = 0.3;
/// What another place must gain: sliding along a wall changes the overlap by percents.
const LEAST_GAIN: f64 = 1.03;
/// Starts: turned by the angle of the first other starts or about twice of it, and shifted in units of the radius.
const WIDE_TURN_RAD: f64 = 0.5;
const SHIFT: f64 = 0.22;
/// Turns that are tried by the wide angle as well.
const WIDE_TURNS: usize = 6;
/// Iterations from each start.
const ITERATIONS: usize = 4;
/// Places that are followed to the end.
const KEPT: usize = 4;
/// Closer than this (radius, radian) two places are the same.
const SAME: f64 = 0.06;

/// Distance of the places that are tried along an undetermined translation, in units of the radius.
const SLIDE: f64 = 0.04;
/// Places on either side.
const SLIDES: usize = 10;

/// A place and how much speaks for it.
type Place = Option<(f64, Track)>;

impl FrameAligner {
    /// The result that most speaks for, where `first` can be doubted.
    pub(super) fn searched(
        &mut self,
        first: Result<(Track, IcpResult)>,
        start: &Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
    ) -> Result<IcpResult> {
        let mut places = [const { None }; KEPT];
        match &first {
            Ok((_, result)) if is_sound(source, target, result) => return first.map(|(_, result)| result),
            Ok((track, result)) if leaves_a_slide(source, target, result) => {
                slides(track, &result.degenerate, source, target, &mut places);
            }
            _ => self.look_around(start, source, target, &mut places),
        }
        let mut best = first;
        let mut most = best.as_ref().map_or(0.0, |(_, result)| evidence(source, target, &result.target_from_source));
        for (_, place) in places.into_iter().flatten() {
            let Ok(other) = self.finish(place, source, target, &start.pose) else { continue };
            let gained = evidence(source, target, &other.1.target_from_source);
            if gained > LEAST_GAIN * most {
                (most, best) = (gained, Ok(other));
            }
        }
        best.map(|(_, result)| result)
    }

    /// Passes the first level from starts all around the guess and keeps the places where the frames agree best.
    fn look_around(
        &mut self,
        start: &Track,
        source: &OrganisedFrame,
        target: &OrganisedFrame,
        places: &mut [Place; KEPT],
    ) {
        let Some(level) = self.first_level(source) else { return };
        let radius = source.points.radius_m;
        let turns = TURNS.iter().map(|axis| Vector3::from(*axis) * TURN_RAD);
        let wide = TURNS[..WIDE_TURNS].iter().map(|axis| Vector3::from(*axis) * WIDE_TURN_RAD);
        for turn in std::iter::once(Vector3::zeros()).chain(turns).chain(wide) {
            for axis in 0..7 {
                let shift = if axis == 6 { Vector3::zeros() } else { Vector3::ith(axis / 2, SHIFT * radius) };
                let shift = if axis % 2 == 0 { shift } else { -shift };
                let pose = Isometry3::from_parts(
                    (start.pose.translation.vector + start.pose.rotation * shift).into(),
                    start.pose.rotation * UnitQuaternion::from_scaled_axis(turn),
                );
                let mut track = Track { pose, ..start.clone() };
                let blocks = blocks(source, level);
                let passed = self.open(&mut track, source, target, blocks);
                if passed.and_then(|()| self.descend_by(&mut track, source, target, blocks, ITERATIONS)).is_ok() {
                    let counts = consistency(source, target, &track.pose, level, COARSE_TOLERANCE * radius);
                    keep(places, weighed(&counts), &track, radius);
                }
            }
        }
    }
}

/// Puts a place among the best, once.
fn keep(places: &mut [Place; KEPT], gained: f64, track: &Track, radius_m: f64) {
    let is_same = |other: &Track| {
        let away = track.pose.rotation.angle_to(&other.pose.rotation);
        let shift = (track.pose.translation.vector - other.pose.translation.vector).norm();
        away < SAME && shift < SAME * radius_m
    };
    let same = places.iter().position(|place| place.as_ref().is_some_and(|(_, other)| is_same(other)));
    let worst = (0..KEPT).min_by(|a, b| value(&places[*a]).total_cmp(&value(&places[*b])));
    if let Some(k) = same.or(worst)
        && gained > value(&places[k])
    {
        places[k] = Some((gained, track.clone()));
    }
}

fn value(place: &Place) -> f64 {
    place.as_ref().map_or(f64::NEG_INFINITY, |(gained, _)| *gained)
}

/// What would tell a translation that is left open may lie out of reach: looks along it.
fn slides(
    track: &Track,
    motions: &[UndeterminedMotion],
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    places: &mut [Place; KEPT],
) {
    let radius = source.points.radius_m;
    let slide = SLIDE * radius;
    for motion in motions {
        for k in (1..=SLIDES).flat_map(|k| [k as f64, -(k as f64)]) {
            let mut other = track.clone();
            other.pose.translation.vector += motion.axis * (k * slide);
            other.rules.extra_variance = (0.25 * slide * slide) as f32;
            other.iterations = 0;
            let gained = evidence(source, target, &other.pose);
            keep(places, gained, &other, radius);
        }
    }
}

fn is_sound(source: &OrganisedFrame, target: &OrganisedFrame, result: &IcpResult) -> bool {
    result.degenerate.is_empty() && result.stop != StopReason::MaxIterations && agrees(source, target, result)
}

/// Whether all that can be doubted is one translation.
fn leaves_a_slide(source: &OrganisedFrame, target: &OrganisedFrame, result: &IcpResult) -> bool {
    matches!(&result.degenerate[..], [motion] if motion.kind == MotionKind::Translation)
        && agrees(source, target, result)
}

/// Whether frames at a pose share enough, and hardly contradict each other.
fn agrees(source: &OrganisedFrame, target: &OrganisedFrame, result: &IcpResult) -> bool {
    let tolerance = COARSE_TOLERANCE * source.points.radius_m;
    let counts = consistency(source, target, &result.target_from_source, DOUBT_LEVEL, tolerance);
    let (compared, hidden) = (counts.compared() as f64, counts.hidden as f64);
    (counts.contradicting + counts.unclear) as f64 <= MOST_WRONG * compared
        && hidden <= MOST_HIDDEN * (compared + hidden)
        && counts.agreeing as f64 >= LEAST_AGREEING * counts.all() as f64
}

/// What speaks for a fine pose.
fn evidence(source: &OrganisedFrame, target: &OrganisedFrame, pose: &Isometry3<f64>) -> f64 {
    let tolerance = FINE_TOLERANCE * source.points.radius_m;
    weighed(&consistency(source, target, pose, FINE_LEVEL, tolerance))
}

/// Agreeing nodes, less the more the frames contradict each other. A share and no sum: on real frames some contradiction
/// is everywhere, and a large overlap must not pay for it.
fn weighed(counts: &FrameConsistency) -> f64 {
    let wrong = (counts.contradicting + counts.unclear) as f64 + HIDDEN * counts.hidden as f64;
    let agreeing = counts.agreeing as f64;
    agreeing / (1.0 + CONTRADICTION * wrong / (agreeing + wrong).max(1.0))
}
