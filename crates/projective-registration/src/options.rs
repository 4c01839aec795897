//! What can be chosen in the registration of frames.

use crate::error::Result;
use crate::shared_error::SharedError;
use rigid_pose::{require_count, require_positive};

/// Options of [`align_frames`](crate::align_frames). The defaults carry no scale: lengths come from the frames.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameAlignmentOptions {
    /// The systematic error that all frames of the sensor share: its part of the covariance does not fall with the number
    /// of pixels. `None`: estimated from the residuals of the pair, which tell the more of it the farther the camera has
    /// moved. Default `None`.
    pub shared_error: Option<SharedError>,
    /// A motion counts as undetermined when the predicted standard deviation of points at the frame's radius exceeds
    /// this, metre. `None`, the default: 1/300 of the radius.
    pub max_motion_sigma_m: Option<f64>,
    /// Whether a search around the guess follows where the pose can be doubted at the end, within about 0.25 of the radius and 30
    /// degrees. Motions that planes leave open are then put where outlines contradict each other least, and a pose that still
    /// contradicts the frames is [`Contradicted`](icp_registration::StopReason::Contradicted). Default: yes.
    pub search: bool,
    /// Iterations in all levels together. Default 60.
    pub max_iterations: usize,
    /// The run has settled as soon as a step is shorter than this multiple of its standard deviation, as the weights of
    /// the pairs tell it; most steps are then taken on a quarter of the nodes, and the last one is taken with the
    /// covariance. `None`, the default: when a step moves points at the radius of the frame by less than 1e-5 of it.
    pub noise_fraction: Option<f64>,
}

impl FrameAlignmentOptions {
    /// Share of the radius beyond whose standard deviation a motion is undetermined where many registrations are put together: poses that
    /// are centimetres weak for a moment have little weight there, and are worth more than none.
    pub const OPEN_IN_A_GRAPH: f64 = 1.0 / 50.0;
}

impl Default for FrameAlignmentOptions {
    fn default() -> Self {
        Self { shared_error: None, max_motion_sigma_m: None, search: true, max_iterations: 60, noise_fraction: None }
    }
}

impl FrameAlignmentOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        require_positive("max_motion_sigma_m", self.max_motion_sigma_m)?;
        require_positive("noise_fraction", self.noise_fraction)?;
        Ok(require_count("max_iterations", self.max_iterations, 1)?)
    }
}
