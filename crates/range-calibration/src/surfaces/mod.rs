//! On-the-job calibration: range terms together with the poses, from surfaces that several stations see (Sect. 5.3).
//!
//! A wall seen from two stations is one wall only with the right range terms: an offset bends corners apart, a periodic
//! term ripples. The registration of `icp-registration` adjusts the poses and asks a `PointModel` how points depend on
//! shared parameters; the sensor model behind that question lives here.

mod amplitude;
mod calibrate;
mod holes;
mod options;
mod outcome;
mod pixels;
mod selection;
mod sensor_model;

pub use calibrate::calibrate_surfaces;
pub use options::{SurfaceCalibrationOptions, SurfaceCapture, SurfaceTerm};
pub use outcome::SurfaceCalibration;
pub use selection::HeldTerm;

impl crate::Error {
    /// What the registration of this station, or all, failed with.
    pub(crate) fn registration(station: &str, reason: impl Into<multiview_registration::Error>) -> Self {
        Self::Registration { station: station.to_owned(), reason: reason.into() }
    }
}
