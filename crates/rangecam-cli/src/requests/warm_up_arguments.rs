//! What can be typed behind `rangecam warmup`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use tasks::{ChangeOptions, DriftOptions, ReferenceUse, TemperatureUse, WarmUpRequest};

use crate::requests::calibration::calibrate_arguments::default_out;
use crate::requests::values::{finite, positive};

/// Arguments of an estimation of a drift.
#[derive(Debug, Args)]
pub(crate) struct WarmUpArguments {
    /// Survey with the timed frames of one camera and scene at rest: samples, phases, ranges or depths.
    survey: PathBuf,
    /// calibration.ron that the drift is added to; default: none is written.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Output folder; default: out/<name of the survey>-warmup.
    #[arg(long, short)]
    out: Option<PathBuf>,
    /// Drift within which the camera counts as stable, millimetre; default: three deviations of a block at the end.
    #[arg(long, value_name = "X", value_parser = positive)]
    tolerance_mm: Option<f64>,
    /// When the camera was switched on, on the clock of the frames' times; default: what the survey states, or else the
    /// first frame.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    power_on: Option<f64>,
    /// Let the drift follow the temperature of the camera as well.
    #[arg(long)]
    temperature: bool,
    /// What the pixels of the camera's optical reference, where the survey states one, are used for.
    #[arg(long, value_enum, default_value_t)]
    reference: Reference,
}

/// [`ReferenceUse`] as it is typed.
#[derive(Debug, Clone, Copy, Default, ValueEnum)]
enum Reference {
    /// Nothing: the drift is that of the scene.
    #[default]
    Ignore,
    /// Their change is subtracted from the scene's: the drift that the reference does not take.
    Subtract,
    /// They take the place of the scene.
    Instead,
}

impl WarmUpArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> WarmUpRequest {
        let temperature = if self.temperature { TemperatureUse::Estimate } else { TemperatureUse::Ignore };
        WarmUpRequest {
            out: self.out.unwrap_or_else(|| default_out(&self.survey, "-warmup")),
            survey: self.survey,
            calibration: self.calibration,
            power_on_s: self.power_on,
            reference: match self.reference {
                Reference::Ignore => ReferenceUse::Ignore,
                Reference::Subtract => ReferenceUse::Subtract,
                Reference::Instead => ReferenceUse::Instead,
            },
            options: DriftOptions {
                temperature,
                tolerance_m: self.tolerance_mm.map(|tolerance_mm| 1e-3 * tolerance_mm),
                ..DriftOptions::default()
            },
            pixels: ChangeOptions::default(),
        }
    }
}
