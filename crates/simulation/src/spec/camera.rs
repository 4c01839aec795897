use camera_model::Camera;
use range_image::{Modulation, PhaseSense};
use serde::{Deserialize, Serialize};

use super::check::{finite, not_negative, positive, require};
use crate::Result;

/// The camera and how it modulates and samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Format, interior orientation, lens.
    pub geometry: Camera,
    /// Modulation frequencies.
    pub modulation_hz: Vec<f64>,
    /// Number of equidistant phase steps.
    #[serde(default = "four")]
    pub phase_steps: usize,
    /// Sense in which the sampled phase grows.
    #[serde(default)]
    pub phase_sense: PhaseSense,
    /// Angle that demodulation adds after the sense is applied.
    #[serde(default)]
    pub phase_offset_rad: f64,
}

/// Light: the camera's own source at the perspective centre, and the room's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IlluminationSpec {
    /// Amplitude that one second of integration gives of a white surface that faces the camera at one metre.
    pub source_power: f64,
    /// Amplitude over mean of the light that comes back, above 0 and at most 1.
    #[serde(default = "half")]
    pub modulation_contrast: f64,
    /// Mean sample that one second of integration gives of a white surface in the light of the room.
    #[serde(default)]
    pub ambient_power: f64,
    /// Fall-off of light towards the image's borders as this power of the cosine of the angle to the axis; 0: none.
    #[serde(default)]
    pub vignetting_exponent: f64,
}

/// How many frames, how long, and when.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExposureSpec {
    /// Frames at each station.
    pub frames_per_station: usize,
    /// Integration time of one sample.
    pub integration_time_s: f64,
    /// Time from one frame to the next; the stations follow each other without a pause.
    #[serde(default = "tenth")]
    pub frame_interval_s: f64,
    /// Time stamp of the first frame.
    #[serde(default)]
    pub start_s: f64,
}

fn four() -> usize {
    4
}

fn half() -> f64 {
    0.5
}

fn tenth() -> f64 {
    0.1
}

impl CameraSpec {
    pub(crate) fn validate(&self) -> Result<()> {
        self.geometry.validate()?;
        require(!self.modulation_hz.is_empty(), "camera.modulation_hz", &self.modulation_hz, "at least one frequency")?;
        for (index, frequency) in self.modulation_hz.iter().enumerate() {
            positive(format!("camera.modulation_hz[{index}]"), *frequency)?;
        }
        let n = self.phase_steps;
        require((3..=64).contains(&n), "camera.phase_steps", &n, "from 3 to 64 phase steps")?;
        let format = self.geometry.format;
        let planes = n.saturating_mul(self.modulation_hz.len());
        let samples = format.width.saturating_mul(format.height).saturating_mul(planes);
        let expected = "a format with at most 2^30 samples a frame";
        require(samples <= 1 << 30, "camera.geometry.format", &format, expected)?;
        finite("camera.phase_offset_rad", self.phase_offset_rad)
    }

    /// The modulations, in the order of the frequencies.
    pub fn modulations(&self) -> Result<Vec<Modulation>> {
        self.modulation_hz.iter().map(|frequency| Ok(Modulation::new(*frequency)?)).collect()
    }
}

impl IlluminationSpec {
    pub(crate) fn validate(&self) -> Result<()> {
        positive("illumination.source_power", self.source_power)?;
        let contrast = self.modulation_contrast;
        let holds = contrast > 0.0 && contrast <= 1.0;
        require(holds, "illumination.modulation_contrast", &contrast, "a contrast above 0 and at most 1")?;
        not_negative("illumination.ambient_power", self.ambient_power)?;
        not_negative("illumination.vignetting_exponent", self.vignetting_exponent)
    }
}

impl ExposureSpec {
    pub(crate) fn validate(&self) -> Result<()> {
        let n = self.frames_per_station;
        require((1..=1_000_000).contains(&n), "exposure.frames_per_station", &n, "from 1 to 1000000 frames")?;
        positive("exposure.integration_time_s", self.integration_time_s)?;
        let interval = self.frame_interval_s;
        require((0.0..=1e9).contains(&interval), "exposure.frame_interval_s", &interval, "from 0 to 1e9 seconds")?;
        finite("exposure.start_s", self.start_s)
    }
}
