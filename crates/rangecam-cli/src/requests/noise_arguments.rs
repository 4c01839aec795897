//! What can be typed behind `rangecam noise`.

use std::path::PathBuf;

use clap::Args;
use tasks::{NoiseFitOptions, NoiseRequest};

use crate::requests::calibration::calibrate_arguments::default_out;

/// Arguments of an estimation of noise.
#[derive(Debug, Args)]
pub(crate) struct NoiseArguments {
    /// Survey with several frames of each station, scene and camera at rest: samples, phases, ranges or depths.
    survey: PathBuf,
    /// calibration.ron that the noise is added to; default: the one beside the survey, or else the nominal camera.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Output folder; default: out/<name of the survey>-noise.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl NoiseArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> NoiseRequest {
        let out = self.out.unwrap_or_else(|| default_out(&self.survey, "-noise"));
        NoiseRequest { survey: self.survey, calibration: self.calibration, options: NoiseFitOptions::default(), out }
    }
}
