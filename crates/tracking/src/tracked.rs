//! What tracking says of each frame.

use nalgebra::{Isometry3, Matrix6};

use crate::motion_model::motion::MotionPrior;

/// Why a frame has no pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LossReason {
    /// Too little of the frame holds surfaces: blank, saturated, out of range.
    TooFewPoints,
    /// Too little of it agrees with what was seen before.
    TooLittleOverlap,
    /// It contradicts what was seen before: residuals are too large.
    LargeResiduals,
    /// The geometry leaves motions undetermined (one wall), and no prior carries the pose far enough.
    Undetermined,
    /// The iterations did not settle.
    NotConverged,
}

impl LossReason {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::TooFewPoints => "too few points",
            Self::TooLittleOverlap => "too little agrees with what was seen before",
            Self::LargeResiduals => "contradicts what was seen before",
            Self::Undetermined => "the surfaces leave motions open",
            Self::NotConverged => "the alignment did not settle",
        }
    }
}

/// State of tracking at a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TrackingState {
    /// The first frame: it is the datum.
    Started,
    /// Tracked from the frame before.
    Tracked,
    /// Found again after a loss.
    Relocalised,
    /// No pose: what is given is the prediction.
    Lost(LossReason),
}

impl TrackingState {
    /// Whether the frame has a pose.
    pub fn has_pose(self) -> bool {
        !matches!(self, Self::Lost(_))
    }

    /// In a word: `started`, `tracked`, `relocalised` or `lost`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Started => "started",
            Self::Tracked => "tracked",
            Self::Relocalised => "relocalised",
            Self::Lost(_) => "lost",
        }
    }
}

/// Pose of one frame of a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedPose {
    /// Time of the frame, second.
    pub timestamp_s: f64,
    /// Pose of the camera in the world, which is the first camera's frame unless the options place it.
    pub world_from_camera: Isometry3<f64>,
    /// Its covariance in the tangent `[dt world axes (m), dtheta camera axes (rad)]`, accumulated since the datum. In a
    /// lost frame that of the prediction, or the radius of the last frame where nothing is known.
    pub covariance: Matrix6<f64>,
    /// Whether this is a pose at all.
    pub state: TrackingState,
    /// The keyframe it is measured from (number in order of making; numbers are not used again).
    pub keyframe: usize,
    /// Pose in the frame of that keyframe.
    pub keyframe_from_camera: Isometry3<f64>,
    /// Fraction of the frame that agrees with the keyframe.
    pub overlap: f64,
    /// Root mean square residual of the registration, metre; 0 where there was none.
    pub rms_m: f64,
    /// Motion since the frame before as the registration alone measured it, where both frames were tracked: what an
    /// inertial unit is corrected by.
    pub measured_motion: Option<MotionPrior>,
}
