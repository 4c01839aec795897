//! Simulated surveys of targets with names, and what the check of names says of them.

use camera_model::{Camera, LensDistortion};
use nalgebra::{Isometry3, Point3};
use orientation::{ImagePoint, NameCheckOptions, NameVerdict, ObservedRange, TieObservation, check_names};

use crate::common::{camera, looking_at, normals, seen};

/// A kind of survey.
#[derive(Clone, Copy)]
pub struct Kind {
    pub stations: usize,
    pub with_ranges: bool,
    /// The names are checked with a camera that has no lens, as before a calibration.
    pub is_nominal: bool,
}

/// Targets of a survey, and the share of them that a station sees.
const TARGETS: usize = 24;
const SEEN: f64 = 0.8;
/// Deviation of the image points, pixel, of what a nominal lens misses, pixel, and of the ranges, metre.
const SIGMA_PX: f64 = 0.1;
const LENS_PX: f64 = 1.5;
const SIGMA_M: f64 = 0.01;

impl Kind {
    /// The camera that names are checked with.
    pub fn camera(self) -> Camera {
        let known = camera();
        let lens = if self.is_nominal { LensDistortion::default() } else { known.lens };
        Camera { lens, ..known }
    }

    /// What the stations of a survey see.
    pub fn survey(self, seed: u64) -> Vec<TieObservation> {
        let (mut normal, mut places) = (normals(seed), normals(seed ^ 0x9e37_79b9));
        // Normal numbers as evenly spread ones.
        let mut place = |half: f64| half * (1.0 - 2.0 * statistics::Distribution::Normal.survival(places()));
        let points: Vec<Point3<f64>> = (0..TARGETS).map(|_| Point3::new(place(0.9), place(0.7), place(0.5))).collect();
        let poses: Vec<Isometry3<f64>> = (0..self.stations)
            .map(|k| {
                let angle = k as f64 * 1.3 + place(0.3);
                looking_at([1.3 * angle.cos(), 1.0 * angle.sin(), 3.0 + place(0.3)], place(3.0))
            })
            .collect();
        let mut out = Vec::new();
        for (station, pose) in poses.iter().enumerate() {
            for (target, point) in points.iter().enumerate() {
                let [col, row] = seen(pose, point);
                let (is_seen, inside) = (place(0.5) + 0.5 < SEEN, camera().contains([col, row]));
                let [dx, dy, dr] = [normal(), normal(), normal()];
                if !(is_seen && inside) {
                    continue;
                }
                let sigma = if self.is_nominal { LENS_PX.hypot(SIGMA_PX) } else { SIGMA_PX };
                let image = ImagePoint::new([col + SIGMA_PX * dx, row + SIGMA_PX * dy], sigma);
                let range_m = (point.coords - pose.translation.vector).norm() + SIGMA_M * dr;
                let range = self.with_ranges.then_some(ObservedRange { range_m, sigma_m: SIGMA_M });
                out.push(TieObservation { station, target, image, range });
            }
        }
        out
    }

    pub fn check(self, observations: &[TieObservation]) -> Vec<NameVerdict> {
        check_names(&self.camera(), observations, &NameCheckOptions::default()).unwrap()
    }
}

/// Gives the name of another target to one that a station sees: of one that this station does not see and another does. Its place in the
/// list; `None` where there is none.
pub fn misread(observations: &mut [TieObservation], seed: u64) -> Option<usize> {
    let count = observations.len();
    for step in 0..count {
        let index = (seed as usize * 7919 + step) % count;
        let station = observations[index].station;
        let sees = |station: usize, target: usize| {
            observations.iter().any(|seen| seen.station == station && seen.target == target)
        };
        let other = (0..TARGETS)
            .map(|k| (k + seed as usize) % TARGETS)
            .find(|&target| !sees(station, target) && observations.iter().any(|seen| seen.target == target));
        if let Some(other) = other {
            observations[index].target = other;
            return Some(index);
        }
    }
    None
}

/// What was found in surveys of a kind.
#[derive(Default)]
pub struct Tally {
    /// Surveys without a wrong name of which a name was doubted.
    pub doubted: usize,
    /// Share of their names that were checked.
    pub checked: f64,
    /// Surveys with a wrong name, in how many it was found, and in how many of these told alone.
    pub wrong: usize,
    pub found: usize,
    pub alone: usize,
    /// Right names of other targets that were doubted in these.
    pub beside: usize,
}

impl Tally {
    pub fn of(kind: Kind, surveys: u64, seed: u64) -> Self {
        let mut tally = Self::default();
        let (mut names, mut checked) = (0, 0);
        for k in 0..surveys {
            let mut survey = kind.survey(1000 * seed + k);
            let verdicts = kind.check(&survey);
            let is_doubted = |verdict: &&NameVerdict| matches!(verdict, NameVerdict::Contradicts { .. });
            tally.doubted += usize::from(verdicts.iter().any(|verdict| is_doubted(&verdict)));
            names += verdicts.len();
            checked += verdicts.iter().filter(|verdict| **verdict != NameVerdict::Open).count();
            let Some(wrong) = misread(&mut survey, k) else { continue };
            tally.wrong += 1;
            let verdicts = kind.check(&survey);
            if let NameVerdict::Contradicts { is_alone, .. } = verdicts[wrong] {
                tally.found += 1;
                tally.alone += usize::from(is_alone);
            }
            let others = survey.iter().zip(&verdicts).filter(|(seen, _)| seen.target != survey[wrong].target);
            tally.beside += others.filter(|(_, verdict)| is_doubted(verdict)).count();
        }
        tally.checked = checked as f64 / names as f64;
        tally
    }
}
