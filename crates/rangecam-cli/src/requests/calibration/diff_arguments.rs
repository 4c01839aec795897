//! What can be typed behind `diff`.

use std::path::PathBuf;

use calibration_tasks::DiffRequest;
use clap::Args;

#[derive(Debug, Args)]
pub(crate) struct DiffArguments {
    /// calibration.ron, or a folder with it.
    first: PathBuf,
    /// The other one.
    second: PathBuf,
    /// Probability that a test says of two calibrations of one unchanged camera that they differ.
    #[arg(long, value_name = "PROBABILITY", default_value_t = 0.01)]
    level: f64,
}

impl DiffArguments {
    pub(crate) fn request(self) -> DiffRequest {
        DiffRequest { first: self.first, second: self.second, level: self.level }
    }
}
