use camera_model::{Camera, InteriorOrientation, LensDistortion};
use range_image::{ImageFormat, Modulation, PhaseSense};
use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// The camera block of a survey: nominal geometry and what its raw data mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurveyCamera {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Distance of neighbouring pixel centres along a row and along a column.
    pub pixel_pitch_mm: [f64; 2],
    /// Nominal principal distance.
    pub principal_distance_mm: f64,
    /// Nominal principal point, origin at the format's centre, y up.
    pub principal_point_mm: [f64; 2],
    /// Modulation frequencies; needed for the levels `samples` and `phase`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub modulation_hz: Vec<f64>,
    /// Number of equidistant phase steps; needed for the level `samples`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_steps: Option<usize>,
    /// Sense of the camera's phase, `Positive` where it grows with range.
    #[serde(default, with = "PhaseSenseInFile")]
    pub phase_sense: PhaseSense,
    /// Added to the phase after its sense is applied.
    #[serde(default)]
    pub phase_offset_rad: f64,
    /// Raw value from which on a sample is saturated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub saturation: Option<f64>,
    /// Factor that raw samples are multiplied by.
    #[serde(default = "one")]
    pub raw_scale: f64,
}

/// The sense in files, in either case of its first letter.
#[derive(Serialize, Deserialize)]
#[serde(remote = "PhaseSense")]
enum PhaseSenseInFile {
    #[serde(alias = "positive")]
    Positive,
    #[serde(alias = "negative")]
    Negative,
}

fn one() -> f64 {
    1.0
}

impl SurveyCamera {
    /// Size of the image and its pixels.
    pub fn format(&self) -> Result<ImageFormat> {
        ImageFormat::new(self.width, self.height, self.pixel_pitch_mm).map_err(|error| value_error(&error))
    }

    /// The modulation of each frequency, in vacuum.
    pub fn modulations(&self) -> Result<Vec<Modulation>> {
        self.modulation_hz.iter().map(|&hz| Modulation::new(hz).map_err(|error| value_error(&error))).collect()
    }

    /// The nominal camera: a pinhole.
    pub fn nominal_camera(&self) -> Result<Camera> {
        let interior = InteriorOrientation {
            principal_point_mm: self.principal_point_mm,
            principal_distance_mm: self.principal_distance_mm,
        };
        Camera::new(self.format()?, interior, LensDistortion::default()).map_err(|error| value_error(&error))
    }
}

fn value_error(error: &dyn std::error::Error) -> Error {
    Error::Value { what: "camera of the survey", field: String::new(), reason: error.to_string() }
}
