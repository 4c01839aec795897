/// Why a frame, or a calibration, is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A frame with another number of samples than the camera delivers.
    #[error(
        "{found} samples, but {frequencies} frequencies of {steps} steps at {width} x {height} pixels are {expected}: hand over \
         whole frames of this camera, or make a processor for the other size"
    )]
    Size {
        /// Samples of the frame.
        found: usize,
        /// Samples that a frame has.
        expected: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Modulation frequencies.
        frequencies: usize,
        /// Phase steps.
        steps: usize,
    },
    /// A time that is not later than that of the frame before, or not finite.
    #[error("time {timestamp_s} s after a frame at {before_s} s: frames come in the order of time")]
    Time {
        /// Time of the frame.
        timestamp_s: f64,
        /// Time of the frame before.
        before_s: f64,
    },
    /// Samples that are not finite numbers in too many pixels.
    #[error(
        "{missing} of {pixels} pixels have samples that are not finite, more than the share of {most}: the frame is damaged"
    )]
    Missing {
        /// Pixels without data.
        missing: usize,
        /// Pixels of the frame.
        pixels: usize,
        /// The share that is allowed.
        most: f64,
    },
    /// An integration time that the calibration was not made for.
    #[error("integration time of {integration_time_s} s: {reason}")]
    Exposure {
        /// Integration time of the frame.
        integration_time_s: f64,
        /// What the calibration has, and what to do.
        reason: String,
    },
    /// A frame without a value that the calibration needs.
    #[error("the calibration depends on {what}, which the frame does not state: give it in `Exposure`")]
    Unstated {
        /// The value.
        what: &'static str,
    },
    /// A calibration that is not one of this camera.
    #[error("{what} of the calibration is {found}, the camera has {expected}: give the calibration of this camera")]
    OtherCamera {
        /// The quantity.
        what: &'static str,
        /// Of the calibration.
        found: String,
        /// Of the camera.
        expected: String,
    },
    /// An option or a property of the camera that is none.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A calibration whose drift follows the frame rate, which a stream does not tell.
    #[error(
        "the calibration's drift follows the frame rate since power-on: take it off with `DriftStage::Ignore`, afterwards"
    )]
    FrameRate,
    /// Pixels, samples or options.
    #[error(transparent)]
    Image(#[from] range_image::Error),
    /// The calibration's values.
    #[error("calibration: {0}")]
    Calibration(String),
    /// The camera's model.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
    /// Range errors and drift.
    #[error(transparent)]
    Models(#[from] error_models::Error),
    /// Scattered light.
    #[error(transparent)]
    Scattering(#[from] scattering_deconvolution::Error),
    /// Wrap counts.
    #[error(transparent)]
    Unwrapping(#[from] phase_unwrap::Error),
    /// Poses.
    #[cfg(feature = "tracking")]
    #[error(transparent)]
    Tracking(#[from] tracking::Error),
}

pub(crate) type Result<T> = std::result::Result<T, Error>;
