//! Other places where two frames may belong.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use crate::partners::track::{Frames, LAST_LEVEL, Track};
use crate::registration::aligner::FrameAligner;
use crate::registration::consistency::{DOUBT_LEVEL, TOLERANCE, consistency};
use crate::registration::search::weighed;
use icp_registration::{MotionKind, UndeterminedMotion};

/// Starts around the guess: turned by this angle, or twice of it, and shifted in units of the radius.
const TURN_RAD: f64 = 0.26;
const SHIFT: f64 = 0.22;
/// Iterations from each start.
const ITERATIONS: usize = 4;
/// Places that are kept.
const KEPT: usize = 4;
/// Closer than this (radius, radian) two places are the same.
const SAME: f64 = 0.06;
/// Distance of the places that are tried along an undetermined translation, in units of the radius.
const SLIDE: f64 = 0.02;
/// Places on either side.
const SLIDES: usize = 20;

/// The best places, each once.
#[derive(Default)]
pub(crate) struct Places([Option<(f64, Track)>; KEPT]);

impl Places {
    pub(crate) fn all(&self) -> impl Iterator<Item = &Track> {
        self.0.iter().flatten().map(|(_, track)| track)
    }

    /// Puts a place among the best.
    fn keep(&mut self, gained: f64, track: &Track, radius_m: f64) {
        let is_same = |other: &Track| {
            let away = track.pose.rotation.angle_to(&other.pose.rotation);
            let shift = (track.pose.translation.vector - other.pose.translation.vector).norm();
            away < SAME && shift < SAME * radius_m
        };
        let value = |place: &Option<(f64, Track)>| place.as_ref().map_or(f64::NEG_INFINITY, |(gained, _)| *gained);
        let same = self.0.iter().position(|place| place.as_ref().is_some_and(|(_, other)| is_same(other)));
        let worst = (0..KEPT).min_by(|a, b| value(&self.0[*a]).total_cmp(&value(&self.0[*b])));
        if let Some(k) = same.or(worst)
            && gained > value(&self.0[k])
        {
            self.0[k] = Some((gained, track.clone()));
        }
    }

    /// What would tell a translation that is left open may lie out of reach: looks along it, in steps that outlines then
    /// refine. Without it, three in a hundred more pairs at half overlap stay open and one less is right.
    pub(crate) fn along(track: &Track, motions: &[UndeterminedMotion], frames: Frames<'_>) -> Self {
        let radius_m = frames.radius_m();
        let mut places = Self::default();
        let slide = SLIDE * radius_m;
        for motion in motions.iter().filter(|motion| motion.kind == MotionKind::Translation) {
            for k in (1..=SLIDES).flat_map(|k| [k as f64, -(k as f64)]) {
                let mut other = track.clone();
                other.pose.translation.vector += motion.axis * (k * slide);
                other.rules.extra_variance = (0.25 * slide * slide) as f32;
                other.iterations = 0;
                let counts = consistency(frames, &other.pose, DOUBT_LEVEL, slide);
                places.keep(weighed(&counts), &other, radius_m);
            }
        }
        places
    }
}

impl FrameAligner {
    /// Passes the first level from starts all around the guess and keeps the places where the frames agree best.
    pub(crate) fn look_around(&self, start: &Track, frames: Frames<'_>) -> Places {
        let mut places = Places::default();
        let level = frames.first_level();
        if level == LAST_LEVEL {
            return places;
        }
        let radius = frames.radius_m();
        // Each start on an aligner of its own: what comes out does not hang on the threads.
        let followed = starts(&start.pose, radius).into_par_iter().map_with(self.clone(), |aligner, pose| {
            let (mut track, blocks) = (Track { pose, ..start.clone() }, frames.blocks(level));
            aligner.open(&mut track, frames, blocks).ok()?;
            aligner.descend(&mut track, frames, blocks, ITERATIONS).ok()?;
            let counts = consistency(frames, &track.pose, level, TOLERANCE * radius);
            Some((weighed(&counts), track))
        });
        let followed: Vec<Option<(f64, Track)>> = followed.collect();
        for (gained, track) in followed.into_iter().flatten() {
            places.keep(gained, &track, radius);
        }
        places
    }
}

/// Poses turned and shifted around one, in the axes of the source: about its camera, for where it stands is better known than where it
/// looks. Turned about one axis or two at once, about one of them twice as far as well, and shifted along one.
fn starts(pose: &Isometry3<f64>, radius_m: f64) -> Vec<Isometry3<f64>> {
    let all = || (0..27).map(|k| Vector3::new(k % 3, k / 3 % 3, k / 9).map(|step| f64::from(step) - 1.0));
    let along = |most: f64| all().filter(move |steps| steps.norm_squared() <= most);
    let twice = along(1.0).filter(|steps| steps.norm_squared() > 0.0).map(|steps| 2.0 * steps);
    let turns = along(2.0).chain(twice).map(|steps| UnitQuaternion::from_scaled_axis(steps * TURN_RAD));
    let start = |turn, steps: Vector3<f64>| pose * Isometry3::from_parts((steps * (SHIFT * radius_m)).into(), turn);
    turns.flat_map(|turn| along(1.0).map(move |steps| start(turn, steps))).collect()
}
