//! What can be typed behind `check`.

use std::path::PathBuf;

use calibration_tasks::CheckRequest;
use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    /// Folder of a survey of frames whose stations overlap.
    survey: PathBuf,
    /// The calibration to check: calibration.ron, or a folder with it; default: that beside the survey.
    #[arg(long, short)]
    calibration: Option<PathBuf>,
    /// Probability that the test says of a calibration that is still right that it is not.
    #[arg(long, value_name = "PROBABILITY", default_value_t = 0.01)]
    level: f64,
    /// Change of the range correction (root mean square) below which it does not matter that terms have moved, metre.
    #[arg(long, value_name = "METRE", default_value_t = 0.001)]
    tolerance: f64,
}

impl CheckArguments {
    pub(crate) fn request(self) -> CheckRequest {
        CheckRequest {
            survey: self.survey,
            calibration: self.calibration,
            level: self.level,
            tolerance_m: self.tolerance,
        }
    }
}
