//! From the guess to the neighbourhood of the answer: levels of falling distance limits on a sample of the points.
//!
//! What draws a pose in from afar differs with the scene: least squares and free normals reach farthest where the clouds
//! overlap well, compatible normals where they overlap little, and either can slide along a wall into a wrong pose. All
//! are tried, and the pose at which most of the sample fits goes on.

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use rigid_pose::{InputError, is_usable, motion_length};
use statistics::upper_median;

use crate::error::Result;
use crate::icp::engine::matching::Points;
use crate::icp::engine::registration::{Engine, Track};
use crate::kernel::RobustKernel;
use crate::parts::{ErrorMetric, MaxNormalAngle, PairRejection, Query, Trimmed, thinned};
use crate::quality::Free;
use crate::system::System;
use crate::target::SAMPLES;

/// Distance limits from coarse to fine: the last one doubled up to the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Largest distance of a pair at the start, metre. `None`: 2.5 times the median distance at the guess, but at least a
    /// quarter of the target's radius and at most all of it.
    pub first_limit_m: Option<f64>,
    /// Largest distance of a pair at the end, metre. `None`: three times the spacing of the target; where that is zero,
    /// a fiftieth of its radius for a surface without gaps.
    pub last_limit_m: Option<f64>,
    /// Source points that the levels before the last work with, and that tell how the score responds to the pose. Default 4000.
    pub points: usize,
    /// Iterations that a level before the last may take. Default 12.
    pub iterations: usize,
    /// Such a level ends when a step is below this fraction of its limit. Default 0.01.
    pub step_fraction: f64,
}

impl Default for Levels {
    fn default() -> Self {
        Self { first_limit_m: None, last_limit_m: None, points: 4000, iterations: 12, step_fraction: 0.01 }
    }
}

impl Levels {
    /// The limits in falling order, metre.
    pub(in crate::icp) fn limits(
        &self,
        engine: &Engine<'_>,
        selected: &[usize],
        guess: &Isometry3<f64>,
    ) -> Result<Vec<f64>> {
        let target = engine.scene.target;
        let last = self.last_limit_m.unwrap_or_else(|| target.default_limit_m());
        let first = if let Some(first) = self.first_limit_m {
            first
        } else {
            let median = median_distance(engine, selected, guess)?;
            (2.5 * median).max(target.radius_m / 4.0).min(target.radius_m)
        };
        let mut limits = vec![last];
        while let Some(&limit) = limits.last()
            && limit * 2.0 <= first
        {
            limits.push(limit * 2.0);
        }
        if limits.last().is_some_and(|&limit| limit < first) {
            limits.push(first);
        }
        limits.reverse();
        Ok(limits)
    }
}

/// Median distance to the target of a sample of the points at the guess, metre; 0 where none has a partner.
fn median_distance(engine: &Engine<'_>, selected: &[usize], guess: &Isometry3<f64>) -> Result<f64> {
    let scene = &engine.scene;
    let distance = |&source: &usize| -> Result<Option<f64>> {
        let moved = guess * scene.source.points[source];
        if !is_usable(&moved) {
            return Err(InputError::NonFinite { what: "source points in the target frame", index: source }.into());
        }
        let (normal, limit_m) = (guess.rotation * scene.source_normals[source], f64::INFINITY);
        let query = Query { source, moved: moved.coords, normal, limit_m, remember: false };
        let partner = engine.parts.matching.partner(&query);
        Ok(partner.found.then(|| (partner.point - query.moved).norm()))
    };
    let distances: Result<Vec<Option<f64>>> = thinned(selected, SAMPLES).par_iter().map(distance).collect();
    Ok(upper_median(&mut distances?.into_iter().flatten().collect::<Vec<f64>>()).max(0.0))
}

/// A metric, a kernel and rejections for the way down.
pub struct Alternative<'a> {
    /// The metric; `None`: that of the registration.
    pub metric: Option<Box<dyn ErrorMetric + 'a>>,
    /// The kernel.
    pub kernel: RobustKernel,
    /// The rejections, in place of those of the registration.
    pub rejection: Vec<Box<dyn PairRejection + 'a>>,
}

impl Alternative<'_> {
    /// Free normals; compatible normals; and these by least squares. `trim`: fraction of the pairs to keep.
    pub fn usual(kernel: RobustKernel, max_normal_angle_rad: Option<f64>, trim: Option<f64>) -> Vec<Self> {
        let with = |kernel: RobustKernel, angle: Option<f64>| Self {
            metric: None,
            kernel,
            rejection: rejections(angle, trim),
        };
        let mut alternatives = vec![with(kernel, None)];
        if max_normal_angle_rad.is_some() {
            alternatives.push(with(kernel, max_normal_angle_rad));
            alternatives.push(with(RobustKernel::None, max_normal_angle_rad));
        }
        alternatives
    }
}

/// The rejections by the angle between normals, radian, and down to a fraction of the pairs, where they are given.
pub(in crate::icp) fn rejections<'a>(angle: Option<f64>, trim: Option<f64>) -> Vec<Box<dyn PairRejection + 'a>> {
    let by_angle = angle.map(|angle| Box::new(MaxNormalAngle(angle)) as Box<dyn PairRejection>);
    by_angle.into_iter().chain(trim.map(|trim| Box::new(Trimmed(trim)) as Box<dyn PairRejection>)).collect()
}

/// Fraction of the distance limit at which a residual counts half in the comparison of tracks.
const FIT_RESIDUAL: f64 = 1.0 / 12.0;

/// The first track with the best fit, or the first error.
fn best_of(tracks: Vec<Result<(f64, Track)>>) -> Result<(f64, Track)> {
    let better = |before, track| match (&before, &track) {
        (Ok((least, _)), Ok((fit, _))) if fit > least => track,
        (Err(_), Ok(_)) => track,
        _ => before,
    };
    tracks.into_iter().reduce(better).unwrap_or(Err(InputError::Numerical {
        what: "the coarse registration",
        why: "there was nothing to try",
    }
    .into()))
}

impl<'p> Engine<'p> {
    /// Runs the levels with each alternative, from the guess and if need be from around it, and returns the track at
    /// whose end most of the sample fits.
    pub(in crate::icp) fn descend(&self, selected: &[usize], guess: &Isometry3<f64>, limits: &[f64]) -> Result<Track> {
        let sample = thinned(selected, self.parts.levels.points);
        let from_guess = best_of(self.tracks(&sample, &[*guess], limits));
        let Some(starts) = self.parts.starts.filter(|_| self.parts.levels.first_limit_m.is_none()) else {
            return from_guess.map(|(_, track)| track);
        };
        let share =
            from_guess.as_ref().map(|(_, track)| self.share_with_partner(selected, track, limits[limits.len() - 1]));
        if share.is_ok_and(|share| share >= starts.convincing) {
            return from_guess.map(|(_, track)| track);
        }
        let scouts = thinned(&sample, starts.points);
        let sum = |sum: Vector3<f64>, &i: &usize| sum + (guess * self.scene.source.points[i]).coords;
        let centre = scouts.iter().fold(Vector3::zeros(), sum) / scouts.len().max(1) as f64;
        let mut tracks: Vec<(f64, Track)> =
            self.tracks(&scouts, &starts.around(guess, &centre, limits[0]), limits).into_iter().flatten().collect();
        // Stable: equal tracks stay in the order of the starts.
        tracks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let poses: Vec<Isometry3<f64>> = tracks.iter().take(starts.refined).map(|(_, track)| track.pose).collect();
        let fine = &limits[limits.len().saturating_sub(2)..];
        let mut refined = vec![from_guess];
        refined.extend(self.tracks(&sample, &poses, fine));
        best_of(refined).map(|(_, track)| track)
    }

    /// The tracks from all starts by all alternatives with their fit on the sample, in that order whatever thread was
    /// first.
    fn tracks(&self, sample: &[usize], starts: &[Isometry3<f64>], limits: &[f64]) -> Vec<Result<(f64, Track)>> {
        let alternatives: Vec<Engine<'_>> = match self.parts.alternatives.as_slice() {
            [] => vec![*self],
            some => some.iter().map(|alternative| self.with(alternative)).collect(),
        };
        let ways: Vec<(&Isometry3<f64>, &Engine<'_>)> =
            starts.iter().flat_map(|start| alternatives.iter().map(move |engine| (start, engine))).collect();
        let run = |&(start, engine): &(&Isometry3<f64>, &Engine<'_>)| {
            let track = engine.down(sample, start, limits)?;
            Ok((self.fit(sample, &track, limits[limits.len() - 1])?, track))
        };
        ways.par_iter().map(run).collect()
    }

    fn with(&self, alternative: &'p Alternative<'p>) -> Engine<'p> {
        let metric = alternative.metric.as_deref().unwrap_or(self.metric);
        Engine { metric, rejection: &alternative.rejection, kernel: alternative.kernel, ..*self }
    }

    fn down(&self, sample: &[usize], guess: &Isometry3<f64>, limits: &[f64]) -> Result<Track> {
        let mut track = Track { pose: *guess, iterations: 0, free: Free::all() };
        let mut points = Points::new(sample.to_vec());
        for limit_m in limits {
            for _ in 0..self.parts.levels.iterations {
                if track.iterations + 1 >= self.parts.max_iterations {
                    return Ok(track);
                }
                let moment = track.moment(*limit_m);
                let step = self.step(&mut track, &moment, &mut points)?;
                if motion_length(&step) < self.parts.levels.step_fraction * limit_m {
                    break;
                }
            }
        }
        Ok(track)
    }

    /// How well a sample fits at the end of a track: its number of pairs, each weighted by its residual.
    fn fit(&self, sample: &[usize], track: &Track, limit_m: f64) -> Result<f64> {
        let moment = track.moment(limit_m);
        let scene = self.scene.at(moment);
        let pairs = self.gated_pairs(&scene, &mut Points::new(sample.to_vec()))?;
        let system = System::new(&scene, self.metric, &pairs, RobustKernel::None);
        let unit = FIT_RESIDUAL * limit_m;
        Ok((0..pairs.len()).map(|i| 1.0 / (1.0 + (system.residual_length(i) / unit).powi(2))).sum())
    }

    /// Share of the points with a partner at the end of a track, normals or not.
    fn share_with_partner(&self, selected: &[usize], track: &Track, limit_m: f64) -> f64 {
        let sample = thinned(selected, SAMPLES);
        let pose = track.pose;
        let found = sample.par_iter().filter(|&&source| {
            let moved = pose * self.scene.source.points[source];
            let normal = pose.rotation * self.scene.source_normals[source];
            let query = Query { source, moved: moved.coords, normal, limit_m, remember: false };
            is_usable(&moved) && self.parts.matching.partner(&query).found
        });
        found.count() as f64 / sample.len().max(1) as f64
    }
}
