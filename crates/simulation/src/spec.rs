//! The description of a simulation, as it is written in RON.

pub(crate) mod camera;
mod check;
pub(crate) mod errors;
pub(crate) mod scene;
pub(crate) mod station;

use range_image::DemodulationOptions;
use ron::extensions::Extensions;
use serde::{Deserialize, Serialize};

use self::camera::{CameraSpec, ExposureSpec, IlluminationSpec};
use self::check::require;
use self::errors::ErrorsSpec;
use self::scene::SceneSpec;
use self::station::StationSpec;
use crate::{Error, Result};

/// A simulation: what is seen, by which camera, from where, and what goes wrong.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationSpec {
    /// What stands in front of the camera.
    pub scene: SceneSpec,
    /// The camera.
    pub camera: CameraSpec,
    /// Its light.
    pub illumination: IlluminationSpec,
    /// Frames, times.
    pub exposure: ExposureSpec,
    /// Where it stands.
    pub stations: Vec<StationSpec>,
    /// What goes wrong; left out: nothing.
    #[serde(default)]
    pub errors: ErrorsSpec,
}

impl SimulationSpec {
    /// Reads and checks a description. `Some(...)` may be left out around optional values.
    ///
    /// # Errors
    /// [`Error::Parse`] with line and column, or what [`Self::validate`] finds.
    pub fn from_ron(text: &str) -> Result<Self> {
        let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
        let spec: Self = options.from_str(text).map_err(|error| Error::Parse {
            line: error.span.start.line,
            column: error.span.start.col,
            message: error.code.to_string(),
        })?;
        spec.validate()?;
        Ok(spec)
    }

    /// Checks every field; the error names the first that is wrong.
    pub fn validate(&self) -> Result<()> {
        self.scene.validate()?;
        self.camera.validate()?;
        self.illumination.validate()?;
        self.exposure.validate()?;
        require(!self.stations.is_empty(), "stations", &self.stations.len(), "at least one station")?;
        for (index, station) in self.stations.iter().enumerate() {
            station.validate(&format!("stations[{index}]"))?;
            let first = self.stations.iter().position(|other| other.name == station.name);
            let field = format!("stations[{index}].name");
            require(first == Some(index), field, &station.name, "a name that no other station has")?;
        }
        let modulations = self.camera.modulations()?;
        let intervals: Vec<f64> = modulations.iter().map(range_image::Modulation::ambiguity_interval_m).collect();
        self.errors.validate(&intervals)?;
        for time in self.exposure.integration_times_s() {
            self.errors.range_at(time)?;
        }
        self.validate_warm_up()
    }

    /// A drift needs what it depends on.
    fn validate_warm_up(&self) -> Result<()> {
        let Some(drift) = &self.errors.warm_up else { return Ok(()) };
        let (power_on, temperature) = (self.exposure.power_on_s, self.exposure.temperature);
        let holds = (drift.transients.is_empty() && drift.frame_rate.is_none()) || power_on.is_some();
        require(holds, "exposure.power_on_s", &power_on, "a time, as errors.warm_up depends on it")?;
        let holds = drift.temperature.is_none() || temperature.is_some();
        require(holds, "exposure.temperature", &temperature, "a temperature, as errors.warm_up depends on it")?;
        if drift.frame_rate.is_some() {
            let (first, changes) = (self.exposure.frame_interval_s, &self.exposure.interval_changes);
            let shortest = changes.iter().map(|change| change.frame_interval_s).fold(first, f64::min);
            let expected = "positive times throughout, as errors.warm_up follows the frame rate";
            require(shortest > 0.0, "exposure.frame_interval_s", &shortest, expected)?;
        }
        Ok(())
    }

    /// The options with which the simulated samples are demodulated: sense, offset, scale, saturation and noise are
    /// those of the simulation.
    pub fn demodulation_options(&self) -> DemodulationOptions {
        let digitisation = self.errors.digitisation;
        DemodulationOptions {
            phase_sense: self.camera.phase_sense,
            phase_offset_rad: self.camera.phase_offset_rad,
            raw_scale: digitisation.map_or(1.0, |d| d.raw_scale),
            saturation: digitisation.and_then(|d| d.highest()),
            noise: self.errors.noise.unwrap_or_default(),
            ..DemodulationOptions::default()
        }
    }
}
