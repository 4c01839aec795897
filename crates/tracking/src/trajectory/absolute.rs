use nalgebra::{Isometry3, Point3, Vector3};

use super::association::{Stamped, associate};
use super::statistics::ErrorStatistics;
use crate::error::Result;
use rigid_pose::{InputError, absolute_orientation, absolute_orientation_with_scale};

/// How an estimate is moved onto the truth before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum TrajectoryAlignment {
    /// Not at all: both are in one frame.
    None,
    /// By the first common pose, position and attitude.
    FirstPose,
    /// By the rigid motion that fits the positions best; they must not lie on a line.
    #[default]
    Rigid,
    /// By the similarity that fits the positions best, where the estimate has no scale of its own (`[Umeyama1991]`).
    Similarity,
}

/// Options of both trajectory errors.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryErrorOptions {
    /// Poses belong together if their times differ by no more, second. Default: 0.01 s.
    pub max_time_difference_s: f64,
    /// Alignment for the absolute error; the relative one needs none. Default: [`TrajectoryAlignment::Rigid`].
    pub alignment: TrajectoryAlignment,
    /// Largest deviation of a step from the one wanted, as a share of it; for steps in seconds and metres. Default:
    /// 0.1.
    pub step_tolerance: f64,
}

impl Default for TrajectoryErrorOptions {
    fn default() -> Self {
        Self { max_time_difference_s: 0.01, alignment: TrajectoryAlignment::default(), step_tolerance: 0.1 }
    }
}

/// A pose that both trajectories have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchedPose {
    /// Index in the estimate.
    pub estimate: usize,
    /// Index in the truth.
    pub truth: usize,
    /// Time of the estimate, second.
    pub timestamp_s: f64,
    /// Aligned estimate.
    pub aligned: Isometry3<f64>,
    /// Aligned less true position in the frame of the truth, metre.
    pub position_error: Vector3<f64>,
    /// Its length, metre.
    pub position_error_m: f64,
    /// Angle between the attitudes, radian.
    pub attitude_error_rad: f64,
}

/// Absolute trajectory error (ATE, also absolute pose error).
#[derive(Debug, Clone, PartialEq)]
pub struct AbsoluteTrajectoryError {
    /// The alignment: `truth = truth_from_estimate * (scale * estimate)`.
    pub truth_from_estimate: Isometry3<f64>,
    /// Scale of the alignment; 1 but for [`TrajectoryAlignment::Similarity`].
    pub scale: f64,
    /// Every common pose in the order of time.
    pub matched: Vec<MatchedPose>,
    /// Position errors, metre.
    pub position_m: ErrorStatistics,
    /// Attitude errors, radian.
    pub attitude_rad: ErrorStatistics,
}

impl AbsoluteTrajectoryError {
    /// The `count` poses of the largest position errors, the worst first.
    pub fn worst(&self, count: usize) -> Vec<MatchedPose> {
        let mut worst = self.matched.clone();
        worst.sort_by(|a, b| b.position_error_m.total_cmp(&a.position_error_m));
        worst.truncate(count);
        worst
    }
}

/// Position and attitude errors of `estimate` against `truth`, both (time in seconds, world from camera) in any order.
///
/// Poses are matched by time and aligned as the options say. Follows `[Sturm2012]`.
///
/// # Errors
/// [`crate::Error::NoCommonTime`]; [`InputError::TooFewPoints`] and [`InputError::Collinear`] where the common positions do not determine
/// the alignment; [`InputError::Empty`], [`InputError::NonFinite`], [`InputError::InvalidOption`] for the input.
pub fn absolute_trajectory_error(
    estimate: &[Stamped],
    truth: &[Stamped],
    options: &TrajectoryErrorOptions,
) -> Result<AbsoluteTrajectoryError> {
    let pairs = associate(estimate, truth, options.max_time_difference_s)?;
    let (truth_from_estimate, scale) = alignment(estimate, truth, &pairs, options.alignment)?;
    let matched: Vec<MatchedPose> = pairs
        .iter()
        .map(|&(e, t)| {
            let (timestamp_s, mut pose) = estimate[e];
            pose.translation.vector *= scale;
            let aligned = truth_from_estimate * pose;
            let position_error = aligned.translation.vector - truth[t].1.translation.vector;
            MatchedPose {
                estimate: e,
                truth: t,
                timestamp_s,
                aligned,
                position_error,
                position_error_m: position_error.norm(),
                attitude_error_rad: truth[t].1.rotation.angle_to(&aligned.rotation),
            }
        })
        .collect();
    let position_m = ErrorStatistics::of(matched.iter().map(|pose| pose.position_error_m));
    let attitude_rad = ErrorStatistics::of(matched.iter().map(|pose| pose.attitude_error_rad));
    let (position_m, attitude_rad) =
        position_m.zip(attitude_rad).ok_or(InputError::Empty { what: "the matched poses" })?;
    Ok(AbsoluteTrajectoryError { truth_from_estimate, scale, matched, position_m, attitude_rad })
}

fn alignment(
    estimate: &[Stamped],
    truth: &[Stamped],
    pairs: &[(usize, usize)],
    alignment: TrajectoryAlignment,
) -> Result<(Isometry3<f64>, f64)> {
    let source: Vec<Point3<f64>> = pairs.iter().map(|&(e, _)| estimate[e].1.translation.vector.into()).collect();
    let target: Vec<Point3<f64>> = pairs.iter().map(|&(_, t)| truth[t].1.translation.vector.into()).collect();
    Ok(match (alignment, pairs) {
        (TrajectoryAlignment::FirstPose, [(e, t), ..]) => (truth[*t].1 * estimate[*e].1.inverse(), 1.0),
        (TrajectoryAlignment::Rigid, _) => (absolute_orientation(&source, &target, None)?.target_from_source, 1.0),
        (TrajectoryAlignment::Similarity, _) => {
            let similarity = absolute_orientation_with_scale(&source, &target, None)?;
            (similarity.orientation.target_from_source, similarity.scale)
        }
        _ => (Isometry3::identity(), 1.0),
    })
}
