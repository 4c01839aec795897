use camera_model::Camera;
use error_models::{RateHistory, RatePhase};
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
    /// An optical reference inside the camera (Sect. 4.7).
    #[serde(default)]
    pub reference_path: Option<ReferencePathSpec>,
}

/// Pixels that see the source through a fibre instead of the scene. The truth has no range there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferencePathSpec {
    /// First and last column.
    pub columns: [usize; 2],
    /// First and last row.
    pub rows: [usize; 2],
    /// Length of the path as a range.
    pub length_m: f64,
    /// Amplitude that one second of integration gives.
    pub power: f64,
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExposureSpec {
    /// Frames at each station with each integration time.
    pub frames_per_station: usize,
    /// Integration time of one sample.
    pub integration_time_s: f64,
    /// Integration times of further frames, which follow at each station in this order.
    #[serde(default)]
    pub further_integration_times_s: Vec<f64>,
    /// Time from one frame to the next; the stations follow each other without a pause.
    #[serde(default = "tenth")]
    pub frame_interval_s: f64,
    /// Changes of this time, in the order of the frames.
    #[serde(default)]
    pub interval_changes: Vec<IntervalChange>,
    /// Time stamp of the first frame.
    #[serde(default)]
    pub start_s: f64,
    /// Time stamp of the moment when the camera was switched on.
    #[serde(default)]
    pub power_on_s: Option<f64>,
    /// How warm the camera is.
    #[serde(default)]
    pub temperature: Option<TemperatureSpec>,
}

/// From a frame on, another time from one frame to the next.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IntervalChange {
    /// Number of the frame, counted over all stations from 0.
    pub from_frame: usize,
    /// Time from it to the next frame, and so on.
    pub frame_interval_s: f64,
}

/// A camera that warms up after it was switched on: the difference to its last temperature falls exponentially.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TemperatureSpec {
    /// Temperature when it was switched on, degree Celsius.
    pub cold_c: f64,
    /// Temperature that it tends to, degree Celsius.
    pub warm_c: f64,
    /// Time in which the difference falls to 1/e.
    pub time_constant_s: f64,
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
        finite("camera.phase_offset_rad", self.phase_offset_rad)?;
        self.reference_path.map_or(Ok(()), |path| path.validate(format.width, format.height))
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

impl ReferencePathSpec {
    pub(crate) fn contains(&self, [col, row]: [usize; 2]) -> bool {
        (self.columns[0]..=self.columns[1]).contains(&col) && (self.rows[0]..=self.rows[1]).contains(&row)
    }

    fn validate(&self, width: usize, height: usize) -> Result<()> {
        for (name, pair, size) in [("columns", self.columns, width), ("rows", self.rows, height)] {
            let holds = pair[0] <= pair[1] && pair[1] < size;
            require(holds, format!("camera.reference_path.{name}"), &pair, "the first and the last inside the image")?;
        }
        positive("camera.reference_path.length_m", self.length_m)?;
        positive("camera.reference_path.power", self.power)
    }
}

impl ExposureSpec {
    pub(crate) fn validate(&self) -> Result<()> {
        let n = self.frames_per_station;
        require((1..=1_000_000).contains(&n), "exposure.frames_per_station", &n, "from 1 to 1000000 frames")?;
        positive("exposure.integration_time_s", self.integration_time_s)?;
        let further = &self.further_integration_times_s;
        require(further.len() <= 100, "exposure.further_integration_times_s", &further.len(), "at most 100 times")?;
        for (index, time) in further.iter().enumerate() {
            let field = format!("exposure.further_integration_times_s[{index}]");
            positive(&field, *time)?;
            let new = !self.integration_times_s().take(index + 1).any(|earlier| earlier.total_cmp(time).is_eq());
            require(new, field, time, "a time unlike those before it")?;
        }
        let interval = self.frame_interval_s;
        require((0.0..=1e9).contains(&interval), "exposure.frame_interval_s", &interval, "from 0 to 1e9 seconds")?;
        let mut before = 0;
        for (index, change) in self.interval_changes.iter().enumerate() {
            let (field, frame) = (format!("exposure.interval_changes[{index}]"), change.from_frame);
            require(frame > before, format!("{field}.from_frame"), &frame, "a frame after the change before")?;
            let interval = change.frame_interval_s;
            let holds = (0.0..=1e9).contains(&interval);
            require(holds, format!("{field}.frame_interval_s"), &interval, "from 0 to 1e9 seconds")?;
            before = frame;
        }
        finite("exposure.start_s", self.start_s)?;
        self.validate_warming()
    }

    fn validate_warming(&self) -> Result<()> {
        if let Some(power_on_s) = self.power_on_s {
            let holds = power_on_s.is_finite() && power_on_s <= self.start_s;
            require(holds, "exposure.power_on_s", &power_on_s, "a time, not after start_s")?;
        }
        let Some(temperature) = &self.temperature else { return Ok(()) };
        finite("exposure.temperature.cold_c", temperature.cold_c)?;
        finite("exposure.temperature.warm_c", temperature.warm_c)?;
        positive("exposure.temperature.time_constant_s", temperature.time_constant_s)?;
        require(self.power_on_s.is_some(), "exposure.power_on_s", &self.power_on_s, "a time, as there is a temperature")
    }

    /// All integration times in the order of their frames at a station.
    pub fn integration_times_s(&self) -> impl Iterator<Item = f64> {
        std::iter::once(self.integration_time_s).chain(self.further_integration_times_s.iter().copied())
    }

    /// Frames of a station at all integration times.
    pub fn frames_at_station(&self) -> usize {
        self.frames_per_station.saturating_mul(1 + self.further_integration_times_s.len())
    }

    /// When a frame is taken, by its number over all stations.
    pub fn timestamp_s(&self, number: usize) -> f64 {
        let (mut begin_s, mut first, mut interval_s) = (self.start_s, 0, self.frame_interval_s);
        for change in self.interval_changes.iter().take_while(|change| change.from_frame <= number) {
            begin_s += (change.from_frame - first) as f64 * interval_s;
            (first, interval_s) = (change.from_frame, change.frame_interval_s);
        }
        begin_s + (number - first) as f64 * interval_s
    }

    /// The frame rates since power-on: before the first frame the camera runs at the rate of the first ones.
    ///
    /// # Errors
    /// An interval of zero, which is no rate.
    pub fn rates(&self) -> Result<Option<RateHistory>> {
        let Some(power_on_s) = self.power_on_s else { return Ok(None) };
        let mut phases = vec![RatePhase { since_s: 0.0, rate_hz: self.frame_interval_s.recip() }];
        phases.extend(self.interval_changes.iter().map(|change| RatePhase {
            since_s: self.timestamp_s(change.from_frame) - power_on_s,
            rate_hz: change.frame_interval_s.recip(),
        }));
        Ok(Some(RateHistory::new(phases)?))
    }

    /// The temperature at a time stamp, where there is one.
    pub fn temperature_c(&self, timestamp_s: f64) -> Option<f64> {
        let (temperature, power_on_s) = (self.temperature?, self.power_on_s?);
        let left = (-(timestamp_s - power_on_s) / temperature.time_constant_s).exp();
        Some(temperature.warm_c + (temperature.cold_c - temperature.warm_c) * left)
    }
}
