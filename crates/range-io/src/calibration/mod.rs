//! A calibration: `calibration.ron`, all that a later correction needs.

mod check;
mod correlation;
mod drift;
mod models;

use std::path::Path;

use error_models::{FixedPattern, FurtherShape, NamedParameter, RangeNoise};
use range_image::{ImageFormat, NoiseModel};
use scattering_deconvolution::Psf;
use serde::{Deserialize, Serialize};

pub use correlation::Correlation;
pub use drift::CalibratedDrift;

use crate::{InvalidField, Result, read_ron_text, text::ron_text};

/// A camera's calibration with the quality of every parameter.
///
/// Parameters keep the units of [`Calibration::CAMERA_PARAMETERS`] and [`error_models::parameter_unit`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// [`Calibration::FORMAT_VERSION`].
    pub format_version: u32,
    /// Size of the image and its pixels.
    pub camera: ImageFormat,
    /// Interior orientation and lens: `xp`, `yp`, `c`, and any of `k1`, `k2`, `k3`, `p1`, `p2`, `b1`, `b2`; a missing one is zero.
    pub parameters: Vec<NamedParameter>,
    /// Range terms for each integration time and modulation frequency.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub range_models: Vec<RangeCalibration>,
    /// Random error of the raw samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseModel>,
    /// Random error of ranges by their amplitude, for cameras that deliver no samples.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_noise: Option<RangeNoise>,
    /// Quality of the noise, where it was estimated: `shot_variance_per_unit`, `dark_sigma` and `quantisation_sigma`, or
    /// `sigma_times_amplitude_m` and `floor_m`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub noise_parameters: Vec<NamedParameter>,
    /// Point spread function of internal scattering.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scattering: Option<Psf>,
    /// Quality of the point spread function's weights and widths (`weight 1`, `sigma_px 1`, ...), where it was estimated.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub scattering_parameters: Vec<NamedParameter>,
    /// Offset of each pixel in range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed_pattern: Option<FixedPattern>,
    /// Drift of all ranges while the camera warms up, and with its temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warm_up: Option<CalibratedDrift>,
    /// Correlations of the estimated parameters; without it they count as uncorrelated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Correlation>,
    /// Where the calibration holds.
    #[serde(default)]
    pub span: ValidSpan,
    /// Where it comes from.
    #[serde(default)]
    pub provenance: Provenance,
}

/// Range terms of one modulation frequency at one integration time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RangeCalibration {
    /// Integration time the terms belong to.
    pub integration_time_s: f64,
    /// Modulation frequency the terms belong to.
    pub modulation_hz: f64,
    /// Any of `d0`, `d2` to `d7`, `e1`, `e2`, and `h1`, `h2`, `h3`; those of [`Self::further`] terms: `s0` on, `q1` on,
    /// `g10` on. A missing one is zero.
    pub parameters: Vec<NamedParameter>,
    /// Smallest and largest range of the fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_span_m: Option<[f64; 2]>,
    /// Smallest and largest amplitude of the fit; needed with `h1`, `h2`, `h3`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub amplitude_span: Option<[f64; 2]>,
    /// Knots, orders and spans of a spline, a polynomial and a surface.
    #[serde(default, skip_serializing_if = "FurtherShape::is_empty")]
    pub further: FurtherShape,
}

/// Smallest and largest value a calibration holds for; `None` where it is not known.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ValidSpan {
    /// Range in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_m: Option<[f64; 2]>,
    /// Amplitude in the camera's unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplitude: Option<[f64; 2]>,
    /// Integration time in seconds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integration_time_s: Option<[f64; 2]>,
    /// Temperature in degrees Celsius.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<[f64; 2]>,
}

/// Where a calibration comes from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Provenance {
    /// Name or folder of the survey.
    pub survey: String,
    /// Method it was estimated by.
    pub method: String,
    /// Redundancy of the adjustment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub redundancy: Option<usize>,
    /// Standard deviation of unit weight of the adjustment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma0: Option<f64>,
    /// Date, as ISO 8601, where one was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub created: Option<String>,
}

impl Calibration {
    /// The version of the format that is written.
    pub const FORMAT_VERSION: u32 = 2;

    /// The oldest version that is read; it differs from the present one in that it knows no `warm_up`.
    pub const OLDEST_FORMAT_VERSION: u32 = 1;

    /// Name of the file in a folder of results.
    pub const FILE_NAME: &str = "calibration.ron";

    /// Names and units of the parameters of interior orientation and lens, in this order everywhere.
    pub const CAMERA_PARAMETERS: [(&str, &str); 10] = [
        ("xp", "mm"),
        ("yp", "mm"),
        ("c", "mm"),
        ("k1", "1/mm^2"),
        ("k2", "1/mm^4"),
        ("k3", "1/mm^6"),
        ("p1", "1/mm"),
        ("p2", "1/mm"),
        ("b1", "1"),
        ("b2", "1"),
    ];

    /// Reads and checks a `calibration.ron`, given by its own path or by its folder's.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = if path.is_dir() { path.join(Self::FILE_NAME) } else { path.to_path_buf() };
        Self::parse(&file, &read_ron_text(&file)?)
    }

    /// Reads and checks the text of a `calibration.ron`; `file` stands for it in messages.
    ///
    /// A file of an older version becomes one of [`Self::FORMAT_VERSION`].
    pub fn parse(file: &Path, text: &str) -> Result<Self> {
        let mut calibration: Self = ron_text::parse(file, text)?;
        calibration
            .renew()
            .and_then(|()| calibration.check())
            .map_err(|invalid| ron_text::at_field(file, text, invalid))?;
        Ok(calibration)
    }

    /// Makes one of the present version of what was read.
    fn renew(&mut self) -> std::result::Result<(), InvalidField> {
        if self.format_version == Self::OLDEST_FORMAT_VERSION {
            if self.warm_up.is_some() {
                let reason = format!("needs `format_version: {}`", Self::FORMAT_VERSION);
                return Err(InvalidField::new("warm_up", reason));
            }
            self.format_version = Self::FORMAT_VERSION;
        }
        Ok(())
    }

    /// Checks names, units, values, spans, table sizes and correlations.
    pub fn validate(&self) -> Result<()> {
        self.check().map_err(|invalid| invalid.in_memory("calibration"))
    }

    /// Checks and writes a `calibration.ron`.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<()> {
        Ok(atomic_output::write_text(path, &self.to_text()?)?)
    }

    /// Checks a calibration and gives the text of its file.
    pub fn to_text(&self) -> Result<String> {
        self.validate()?;
        ron_text::to_text(self)
    }
}
