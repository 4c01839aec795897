//! What can be typed behind `rangecam targets`.

use std::path::PathBuf;

use clap::Args;
use target_tasks::{TargetKind, TargetsRequest};

use crate::requests::calibration::calibrate_arguments::default_out;
use crate::requests::values::positive;

/// Arguments of a search for targets.
#[derive(Debug, Args)]
pub(crate) struct TargetsArguments {
    /// Survey, or folder of images (PNG, JPEG) of one camera, each of them a station.
    survey: PathBuf,
    /// What to look for: `checkerboard 9x6 0.025` (inner corners, side of a field in metre), `circles 10x10 0.0254` or
    /// `asymmetric-circles 4x11 0.02` (discs, metre between their centres); behind these the diameter of a larger disc at
    /// the origin over that of the others, if there is one.
    #[arg(long, short, num_args = 1..=4, value_names = ["KIND", "SIZE", "METRE", "RATIO"], required = true)]
    kind: Vec<String>,
    /// calibration.ron whose scattering is taken off; default: the one beside the survey.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Principal distance of a folder of images; default: from the perspective of the boards.
    #[arg(long, value_name = "PIXELS", value_parser = positive)]
    principal_distance: Option<f64>,
    /// Standard deviation of the board's coordinates, which makes them control; default: they are approximate.
    #[arg(long, value_name = "METRE", value_parser = positive)]
    board_sigma: Option<f64>,
    /// Output folder, a survey that `calibrate` takes; default: out/<name of the survey>-targets.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl TargetsArguments {
    /// The request behind the arguments, or what is wrong with the kind.
    pub(crate) fn request(self) -> Result<TargetsRequest, String> {
        let out = self.out.unwrap_or_else(|| default_out(&self.survey, "-targets"));
        Ok(TargetsRequest {
            kind: TargetKind::parse(&self.kind)?,
            survey: self.survey,
            calibration: self.calibration,
            principal_distance_px: self.principal_distance,
            board_sigma_m: self.board_sigma,
            out,
        })
    }
}
