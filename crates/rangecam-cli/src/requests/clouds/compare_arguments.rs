//! What can be typed behind `compare`.

use std::path::PathBuf;

use clap::Args;
use tasks::{CompareAlignment, CompareRequest};

use crate::requests::values::{not_negative, positive};

#[derive(Debug, Args)]
pub(crate) struct CompareArguments {
    /// The one.
    first: PathBuf,
    /// The other, taken as the reference.
    second: PathBuf,
    /// Move the first onto the second by a rigid motion before they are compared: clouds are registered (they must
    /// overlap already), trajectories fitted.
    #[arg(long)]
    align: bool,
    /// As --align, with a scale; for trajectories.
    #[arg(long)]
    scale: bool,
    /// Leave out points of a cloud that are farther from the reference, metre; default: none.
    #[arg(long, value_name = "METRES", value_parser = positive)]
    max_distance: Option<f64>,
    /// Poses of trajectories belong together if their times differ by no more, second.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.01, value_parser = not_negative)]
    time_tolerance: f64,
    /// Output folder for comparison.json and report.html, with pictures; default: nothing is written.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl CompareArguments {
    pub(crate) fn request(self) -> CompareRequest {
        let alignment = match (self.align, self.scale) {
            (_, true) => CompareAlignment::Similarity,
            (true, false) => CompareAlignment::Rigid,
            (false, false) => CompareAlignment::None,
        };
        CompareRequest {
            alignment,
            max_distance_m: self.max_distance,
            max_time_difference_s: self.time_tolerance,
            out: self.out,
            ..CompareRequest::new(self.first, self.second)
        }
    }
}
