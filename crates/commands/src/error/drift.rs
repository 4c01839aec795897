//! Why the drift of a view is not known, and what to do about it.

use thiserror::Error;

/// Why the drift of a view is not known.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DriftError {
    /// The survey does not say what the drift depends on.
    #[error("the calibrated drift depends on {quantity}, and survey.ron has no `{field}`; add it, or {LEAVE}")]
    Missing {
        /// Time or temperature.
        quantity: &'static str,
        /// The field of `survey.ron`.
        field: String,
    },
    /// A frame at a time or temperature that the drift was not fitted for.
    #[error("frame {frame}: {source}; where the drift does not matter, {LEAVE}")]
    Outside {
        /// Position of the frame in the survey.
        frame: usize,
        /// The value and the span.
        source: error_models::Error,
    },
    /// The drift follows the frame rate, which the survey does not tell.
    #[error("the calibrated drift follows the frame rate: {0}; {STATE}, or {LEAVE}")]
    FrameRates(error_models::Error),
    /// The drift of a frame follows the rate of a time that nothing is known of.
    #[error("frame {frame}: {source}; {STATE}, or {LEAVE}")]
    UnknownRate {
        /// Position of the frame in the survey.
        frame: usize,
        /// The stretch of time.
        source: error_models::Error,
    },
    /// The calibration's drift has no covariance.
    #[error(transparent)]
    Calibration(#[from] range_io::Error),
    /// Too few pixels show the optical reference.
    #[error(
        "{usable} of the {pixels} pixels of `reference_path` can be used (not saturated, dark, or outside the \
         calibrated ranges and amplitudes), expected at least {needed}"
    )]
    Reference {
        /// Pixels that can be used.
        usable: usize,
        /// Pixels of the rectangle.
        pixels: usize,
        /// Pixels that a mean with a standard deviation needs.
        needed: usize,
    },
}

/// What a user can do where a drift is not known.
const LEAVE: &str =
    "leave the drift in the ranges by `CorrectRange(warm_up: leave)` of a pipeline or `calibrate --warm-up leave`";

/// What a user can do where the frames do not tell their rate.
const STATE: &str = "state `frame_rates: [(since_s: .., rate_hz: ..)]` in survey.ron, from power-on on";
