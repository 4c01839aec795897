//! What can be typed behind `rangecam scattering`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use tasks::{EstimationOptions, ScatteringRequest, TermCount, TermShape};

use crate::requests::calibration::calibrate_arguments::default_out;

/// Arguments of an estimation of scattering.
#[derive(Debug, Args)]
pub(crate) struct ScatteringArguments {
    /// Survey with bright objects in the foreground, at several distances and places of the image.
    with_object: PathBuf,
    /// Survey of the same stations without them.
    without_object: PathBuf,
    /// Number of Gaussians; default: as many, up to three, as the captures ask for and determine.
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u8).range(1..=4))]
    terms: Option<u8>,
    /// Shape of the Gaussians.
    #[arg(long, value_enum, default_value_t = ShapeName::Round)]
    shape: ShapeName,
    /// calibration.ron that the point spread function is added to; default: the one beside the survey without objects,
    /// or else the nominal camera.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Output folder; default: out/<name of the survey with objects>-scattering.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ShapeName {
    /// One width.
    Round,
    /// One width along rows and one along columns.
    Elliptic,
}

impl ScatteringArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> ScatteringRequest {
        let standard = EstimationOptions::default();
        let options = EstimationOptions {
            terms: self.terms.map_or(standard.terms, |terms| TermCount::Exactly(terms.into())),
            shape: match self.shape {
                ShapeName::Round => TermShape::Round,
                ShapeName::Elliptic => TermShape::Elliptic,
            },
            ..standard
        };
        let out = default_out(&self.with_object, "-scattering");
        ScatteringRequest {
            with_object: self.with_object,
            without_object: self.without_object,
            calibration: self.calibration,
            options,
            out: self.out.unwrap_or(out),
        }
    }
}
