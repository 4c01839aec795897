//! Errors of a trajectory against another.

use std::path::Path;

use nalgebra::Isometry3;
use pipeline::{Error, Result};
use range_io::trajectory::read_any_trajectory;
use serde::Serialize;
use tracking::{
    AbsoluteTrajectoryError, ErrorStatistics, RelativePoseError, RelativeStep, TrajectoryAlignment,
    TrajectoryErrorOptions, absolute_trajectory_error, relative_pose_error,
};

use crate::compare::{CompareAlignment, CompareRequest};

/// Errors of one trajectory against another.
#[derive(Debug, Clone, Serialize)]
pub struct TrajectoryComparison {
    /// Poses of the first and of the second.
    pub poses: [usize; 2],
    /// Poses that both have at the same time.
    pub matched: usize,
    /// Absolute errors, as the trajectories stand and aligned as far as was asked for.
    pub absolute: Vec<AbsoluteSummary>,
    /// Relative errors over steps of one pose, one second and one metre, as far as the trajectory has them.
    pub relative: Vec<RelativeSummary>,
    /// The poses of the largest position errors, in the last of the alignments: time in seconds, error in metres.
    pub worst: Vec<[f64; 2]>,
}

/// Absolute error after one alignment.
#[derive(Debug, Clone, Serialize)]
pub struct AbsoluteSummary {
    /// Name of the alignment.
    pub alignment: &'static str,
    /// Scale that the first was multiplied with.
    pub scale: f64,
    /// Position errors, metre.
    pub position_m: TrajectoryStatistics,
    /// Attitude errors, degree.
    pub attitude_deg: TrajectoryStatistics,
}

/// Relative error over one step.
#[derive(Debug, Clone, Serialize)]
pub struct RelativeSummary {
    /// The step in words.
    pub step: &'static str,
    /// Steps that were compared.
    pub steps: usize,
    /// Errors of the translation, metre.
    pub translation_m: TrajectoryStatistics,
    /// Errors of the rotation, degree.
    pub rotation_deg: TrajectoryStatistics,
}

/// Statistics of errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrajectoryStatistics {
    /// Root mean square.
    pub rms: f64,
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// Standard deviation about the mean.
    pub standard_deviation: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

/// Curves for pictures, of the last alignment.
#[derive(Debug)]
pub(crate) struct TrackCurves {
    pub(crate) alignment: &'static str,
    /// Time since the first pose, aligned and true position, position and attitude error.
    pub(crate) absolute: Vec<TrackPoint>,
    /// Name of a step, and time with translation (m) and rotation error (degree).
    pub(crate) relative: Vec<(&'static str, Vec<[f64; 3]>)>,
}

/// One common pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrackPoint {
    pub(crate) time_s: f64,
    pub(crate) ours: [f64; 3],
    pub(crate) truth: [f64; 3],
    pub(crate) position_error_m: f64,
    pub(crate) attitude_error_deg: f64,
}

const WORST: usize = 5;
const STEPS: [(&str, RelativeStep); 3] =
    [("1 pose", RelativeStep::Frames(1)), ("1 s", RelativeStep::Seconds(1.0)), ("1 m", RelativeStep::Metres(1.0))];

type Stamped = (f64, Isometry3<f64>);

pub(crate) fn compare(
    first: &Path,
    second: &Path,
    request: &CompareRequest,
) -> Result<(TrajectoryComparison, TrackCurves)> {
    let (ours, truth) = (stamped(first)?, stamped(second)?);
    let wrong = |error: tracking::Error| {
        let (first, second) = (first.display(), second.display());
        Error::comparison(&format!("{first} against {second}"), &error)
    };
    let alignments: &[(&str, TrajectoryAlignment)] = match request.alignment {
        CompareAlignment::None => &[("as they stand", TrajectoryAlignment::None)],
        CompareAlignment::Rigid => {
            &[("as they stand", TrajectoryAlignment::None), ("rigid", TrajectoryAlignment::Rigid)]
        }
        CompareAlignment::Similarity => &[
            ("as they stand", TrajectoryAlignment::None),
            ("rigid", TrajectoryAlignment::Rigid),
            ("with scale", TrajectoryAlignment::Similarity),
        ],
    };
    let options = TrajectoryErrorOptions {
        max_time_difference_s: request.max_time_difference_s,
        ..TrajectoryErrorOptions::default()
    };
    let mut absolute = Vec::new();
    for &(name, alignment) in alignments {
        let options = TrajectoryErrorOptions { alignment, ..options.clone() };
        absolute.push((name, absolute_trajectory_error(&ours, &truth, &options).map_err(wrong)?));
    }
    // A short or standing trajectory has no step of a second or a metre.
    let relative: Vec<(&'static str, RelativePoseError)> = STEPS
        .into_iter()
        .filter_map(|(name, step)| Some((name, relative_pose_error(&ours, &truth, step, &options).ok()?)))
        .collect();
    let Some((alignment, last)) = absolute.last() else {
        return Err(Error::Compare("no alignment was asked for".to_owned()));
    };
    let comparison = TrajectoryComparison {
        poses: [ours.len(), truth.len()],
        matched: last.matched.len(),
        absolute: absolute.iter().map(|(name, error)| AbsoluteSummary::new(name, error)).collect(),
        relative: relative.iter().map(|(name, error)| RelativeSummary::new(name, error)).collect(),
        worst: last.worst(WORST).iter().map(|pose| [pose.timestamp_s, pose.position_error_m]).collect(),
    };
    let curves = TrackCurves {
        alignment,
        absolute: last.matched.iter().map(|pose| point(pose, &truth, last)).collect(),
        relative: relative.iter().map(|(name, error)| (*name, steps(error, last))).collect(),
    };
    Ok((comparison, curves))
}

fn stamped(path: &Path) -> Result<Vec<Stamped>> {
    let poses = read_any_trajectory(path)?;
    Ok(poses.iter().map(|pose| (pose.timestamp_s, pose.world_from_camera)).collect())
}

fn point(pose: &tracking::MatchedPose, truth: &[Stamped], all: &AbsoluteTrajectoryError) -> TrackPoint {
    TrackPoint {
        time_s: pose.timestamp_s - start(all),
        ours: pose.aligned.translation.vector.into(),
        truth: truth[pose.truth].1.translation.vector.into(),
        position_error_m: pose.position_error_m,
        attitude_error_deg: pose.attitude_error_rad.to_degrees(),
    }
}

fn steps(error: &RelativePoseError, all: &AbsoluteTrajectoryError) -> Vec<[f64; 3]> {
    let value = |step: &tracking::RelativeError| {
        [step.timestamps_s[0] - start(all), step.translation_error_m, step.rotation_error_rad.to_degrees()]
    };
    error.steps.iter().map(value).collect()
}

fn start(all: &AbsoluteTrajectoryError) -> f64 {
    all.matched.first().map_or(0.0, |pose| pose.timestamp_s)
}

impl AbsoluteSummary {
    fn new(alignment: &'static str, error: &AbsoluteTrajectoryError) -> Self {
        Self {
            alignment,
            scale: error.scale,
            position_m: TrajectoryStatistics::new(&error.position_m, 1.0),
            attitude_deg: TrajectoryStatistics::new(&error.attitude_rad, 1.0_f64.to_degrees()),
        }
    }
}

impl RelativeSummary {
    fn new(step: &'static str, error: &RelativePoseError) -> Self {
        Self {
            step,
            steps: error.steps.len(),
            translation_m: TrajectoryStatistics::new(&error.translation_m, 1.0),
            rotation_deg: TrajectoryStatistics::new(&error.rotation_rad, 1.0_f64.to_degrees()),
        }
    }
}

impl TrajectoryStatistics {
    fn new(errors: &ErrorStatistics, unit: f64) -> Self {
        Self {
            rms: unit * errors.rms,
            mean: unit * errors.mean,
            median: unit * errors.median,
            standard_deviation: unit * errors.standard_deviation,
            min: unit * errors.min,
            max: unit * errors.max,
        }
    }
}
