//! What is done with each frame, and its limits.

use crate::carried::CarryOptions;
use crate::error::{Error, Result};

/// The stages of a frame; those that a calibration has nothing for are left out by themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct Stages {
    /// Light scattered inside the lens is taken off; `None`: it stays. Default: that of [`DeconvolveStage`].
    pub deconvolve: Option<DeconvolveStage>,
    /// How whole ambiguity intervals are found. Default: that of [`UnwrapStage`].
    pub unwrap: UnwrapStage,
    /// Whether a calibrated drift is taken off. Default: [`DriftStage::Apply`].
    pub drift: DriftStage,
    /// The camera's pose, from points without a flag; `None`, the default: not sought. A search by
    /// [`Relocalisation::Coarse`](tracking::Relocalisation::Coarse) goes on [beside](tracking::Relocalisation::Beside) the frames.
    #[cfg(feature = "tracking")]
    pub tracking: Option<tracking::TrackerOptions>,
}

impl Default for Stages {
    /// All that takes errors off; no pose.
    fn default() -> Self {
        Self {
            deconvolve: Some(DeconvolveStage::default()),
            unwrap: UnwrapStage::default(),
            drift: DriftStage::default(),
            #[cfg(feature = "tracking")]
            tracking: None,
        }
    }
}

/// How scattered light is taken off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeconvolveStage {
    /// Tikhonov term of the inverse filter; zero, the default, is the plain inverse.
    pub regularisation: f64,
    /// Whether dark pixels are asked for light from outside the image, as a pipeline does; what it spoils is flagged. It costs
    /// nothing where no block of the image is dark, and allocates where one is. Default: true.
    pub outside_light: bool,
}

impl Default for DeconvolveStage {
    fn default() -> Self {
        Self { regularisation: 0.0, outside_light: true }
    }
}

/// How whole ambiguity intervals are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnwrapStage {
    /// No range is longer, metre. `None`, the default: 15 m, or the interval in which several frequencies together are
    /// unique, where that is shorter.
    pub maximum_range_m: Option<f64>,
    /// Below this confidence (0 to 1) a pixel is flagged as unsure. Default: 0.5.
    pub minimum_confidence: f64,
    /// When the counts of one frequency are carried from the frame before. Several frequencies decide pixel by pixel.
    pub carry: CarryOptions,
}

impl Default for UnwrapStage {
    fn default() -> Self {
        Self { maximum_range_m: None, minimum_confidence: 0.5, carry: CarryOptions::default() }
    }
}

/// What is done with a calibrated drift.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DriftStage {
    /// It is taken off by time since power-on and temperature.
    #[default]
    Apply,
    /// It stays.
    Ignore,
}

/// Between which bounds a stream is taken for one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// After a longer gap nothing is carried over, second. Default: 0.25 s: what moves at a metre a second stays within half
    /// an interval of 0.5 m, and cameras deliver at 10 Hz and more.
    pub longest_gap_s: f64,
    /// Share of pixels with samples that are not finite, above which a frame is refused. Default: 0.5. Fewer are flagged as
    /// without data, pixel by pixel.
    pub most_missing: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { longest_gap_s: 0.25, most_missing: 0.5 }
    }
}

impl Limits {
    pub(crate) fn validate(&self) -> Result<()> {
        let bad = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
        if self.longest_gap_s.is_nan() || self.longest_gap_s <= 0.0 {
            return bad("longest_gap_s", self.longest_gap_s, "positive");
        }
        if !(0.0..=1.0).contains(&self.most_missing) {
            return bad("most_missing", self.most_missing, "a share from 0 to 1");
        }
        Ok(())
    }
}

impl UnwrapStage {
    pub(crate) fn validate(&self) -> Result<()> {
        let bad = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
        match self.maximum_range_m {
            Some(value) if !(value.is_finite() && value > 0.0) => {
                return bad("maximum_range_m", value, "positive and finite");
            }
            _ => {}
        }
        if !(0.0..=1.0).contains(&self.minimum_confidence) {
            return bad("minimum_confidence", self.minimum_confidence, "from 0 to 1");
        }
        Ok(())
    }
}
