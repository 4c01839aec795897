//! The state that stages pass on.

use camera_model::{Camera, RayTable};
use point_cloud::Cloud;
use range_io::calibration::Calibration;

use crate::survey::outcome::Outcome;
use crate::survey::span::SpanTally;

/// A survey on its way through a pipeline.
pub struct Work {
    /// The calibration, where there is one.
    pub calibration: Option<Calibration>,
    /// The calibrated camera, where there is one; `outcome.camera` is the one in use.
    pub calibrated_camera: Option<Camera>,
    /// Rays of the camera in use.
    pub rays: RayTable,
    /// Amplitude below which the phase of a single frame is too noisy, as `Demodulate` was told.
    pub low_amplitude: Option<f64>,
    /// Unflagged points with normals, from `Register` on.
    pub station_clouds: Vec<Cloud>,
    /// Pixels inside and outside the calibration's span.
    pub span: SpanTally,
    /// What the stages have made so far.
    pub outcome: Outcome,
}
