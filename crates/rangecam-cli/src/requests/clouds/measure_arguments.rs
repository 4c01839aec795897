//! What can be typed behind `measure`.

use std::path::PathBuf;

use clap::Args;
use cloud_tasks::MeasureRequest;

use crate::requests::calibration::calibrate_arguments::default_out;

#[derive(Debug, Args)]
pub(crate) struct MeasureArguments {
    /// Folder of a result with `cloud.ply` and `common_errors.ron`, as `run` writes it.
    result: PathBuf,
    /// RON file with named regions and the lengths between them.
    #[arg(long, short, value_name = "FILE")]
    lengths: PathBuf,
    /// Output folder; default: out/<name of the result>-lengths.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl MeasureArguments {
    pub(crate) fn request(self) -> MeasureRequest {
        let out = self.out.unwrap_or_else(|| default_out(&self.result, "-lengths"));
        MeasureRequest { result: self.result, lengths: self.lengths, out }
    }
}
