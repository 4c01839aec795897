//! What tracking has made of each frame and of all of them.

use nalgebra::Isometry3;
use pipeline::survey::StationPose;
use point_cloud::Cloud;
use serde::Serialize;
use tracking::{LossReason, TrackedPose, TrackingState};

use crate::track::summary::TrackSummary;

/// What can be done with a tracked sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum TrackVerdict {
    /// Every frame has a pose.
    #[default]
    Tracked,
    /// Some frames have none; the camera was found again.
    Interrupted,
    /// The camera was lost and not found again until the end, or most frames have no pose: no success.
    Lost,
}

/// One frame.
#[derive(Debug, Clone, Serialize)]
pub struct TrackedFrame {
    /// Name of its pose in `stations.csv`: the station, with the frame's position in the survey where a station has
    /// several frames.
    pub name: String,
    /// Position in the survey, from 0.
    pub index: usize,
    /// Time, second.
    pub timestamp_s: f64,
    /// `started`, `tracked`, `relocalised` or `lost`.
    pub state: &'static str,
    /// Why it is lost.
    pub reason: Option<&'static str>,
    /// Number of the keyframe it was measured from.
    pub keyframe: Option<usize>,
    /// Whether a keyframe was made of it.
    pub became_keyframe: bool,
    /// Part of the frame that agrees with the keyframe.
    pub overlap: f64,
    /// Root mean square residual, metre.
    pub rms_m: Option<f64>,
    /// Standard deviation of the position in space since the datum, metre.
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of the attitude about all axes, degree.
    pub attitude_sigma_deg: Option<f64>,
    /// Wall-clock time of tracking, millisecond.
    pub track_ms: f64,
    /// The same with reading and correcting the frame.
    pub total_ms: f64,
}

/// Frames without a pose that follow each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackLoss {
    /// Time of the first of them, second.
    pub from_s: f64,
    /// Time of the frame at which the camera was found again, second; `None` where it was not.
    pub found_s: Option<f64>,
    /// Frames.
    pub frames: usize,
    /// Reason at the first of them.
    pub reason: &'static str,
}

/// Errors where the truth is known, both paths brought together at their first pose.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct TrackTruth {
    /// Root mean square position error of the poses as they were tracked, metre.
    pub position_error_rms_m: f64,
    /// Largest of them, metre.
    pub position_error_max_m: f64,
    /// Root mean square position error of the adjusted poses, metre.
    pub adjusted_position_error_rms_m: f64,
    /// Largest attitude error as tracked, degree.
    pub attitude_error_max_deg: f64,
}

/// All that is written and pictured.
pub(crate) struct Tracked {
    /// One a frame, in the order of time.
    pub(crate) poses: Vec<FramePose>,
    /// The map in the world's frame.
    pub(crate) map: Cloud,
    /// Index of the world's axis that points up.
    pub(crate) vertical_axis: usize,
    /// Every figure, with the frames in the same order.
    pub(crate) summary: TrackSummary,
}

/// What is kept of a frame's pose: of a path of 100,000 frames the poses with all their covariances would be half a gigabyte.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FramePose {
    /// Time, second.
    pub(crate) timestamp_s: f64,
    /// Whether it is a pose at all.
    pub(crate) is_known: bool,
    /// As it was tracked.
    pub(crate) tracked: Isometry3<f64>,
    /// After all loops were closed.
    pub(crate) adjusted: Isometry3<f64>,
    /// Standard deviations of the position along the world's axes, metre, and of omega, phi, kappa, radian.
    pub(crate) sigmas: Option<([f64; 3], [f64; 3])>,
    /// Number of the keyframe that it hangs on, and its pose there; `None` before the first keyframe.
    pub(crate) from_keyframe: Option<(usize, Isometry3<f64>)>,
}

impl FramePose {
    /// Of a pose just tracked, which hangs on a keyframe if there is one.
    pub(crate) fn new(pose: &TrackedPose, has_keyframes: bool) -> Self {
        Self {
            timestamp_s: pose.timestamp_s,
            is_known: pose.state.has_pose(),
            tracked: pose.world_from_camera,
            adjusted: pose.world_from_camera,
            sigmas: station_pose(pose).and_then(|known| known.sigmas()),
            from_keyframe: has_keyframes.then_some((pose.keyframe, pose.keyframe_from_camera)),
        }
    }
}

/// The pose with its covariance where there is one.
pub(crate) fn station_pose(pose: &TrackedPose) -> Option<StationPose> {
    let known = StationPose { world_from_camera: pose.world_from_camera, covariance: Some(pose.covariance) };
    pose.state.has_pose().then_some(known)
}

pub(crate) fn state(state: TrackingState) -> &'static str {
    match state {
        TrackingState::Started => "started",
        TrackingState::Relocalised => "relocalised",
        TrackingState::Lost(_) => "lost",
        // States that came later are kinds of having a pose.
        _ => "tracked",
    }
}

pub(crate) fn reason(state: TrackingState) -> Option<&'static str> {
    let TrackingState::Lost(reason) = state else { return None };
    Some(match reason {
        LossReason::TooFewPoints => "too few points",
        LossReason::TooLittleOverlap => "too little agrees with what was seen before",
        LossReason::LargeResiduals => "contradicts what was seen before",
        LossReason::Undetermined => "the surfaces leave motions open",
        LossReason::NotConverged => "the alignment did not settle",
        _ => "another reason",
    })
}
