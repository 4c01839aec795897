//! The state that stages pass on.

use camera_model::{Camera, RayTable};
use point_cloud::Cloud;
use range_io::calibration::Calibration;

use crate::outcome::Outcome;
use crate::span::SpanTally;

/// A survey on its way through a pipeline.
pub(crate) struct Work {
    pub(crate) calibration: Option<Calibration>,
    /// The calibrated camera, where there is one; `outcome.camera` is the one in use.
    pub(crate) calibrated_camera: Option<Camera>,
    pub(crate) rays: RayTable,
    /// Amplitude below which the phase of a single frame is too noisy, as `Demodulate` was told.
    pub(crate) low_amplitude: Option<f64>,
    /// Unflagged points with normals, from `Register` on.
    pub(crate) station_clouds: Vec<Cloud>,
    /// Pixels inside and outside the calibration's span.
    pub(crate) span: SpanTally,
    pub(crate) outcome: Outcome,
}
