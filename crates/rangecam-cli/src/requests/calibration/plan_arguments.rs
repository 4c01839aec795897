//! What can be typed behind `rangecam plan`.

use std::path::PathBuf;

use calibration_tasks::{CandidateGrid, NetworkPlanRequest, PlanOptions};
use clap::Args;

use crate::requests::calibration::calibrate_arguments::{DatumName, default_out, selection};
use crate::requests::values::{Terms, name, positive, terms};

/// Arguments of a plan.
#[derive(Debug, Args)]
pub(crate) struct PlanArguments {
    /// Folder with survey.ron and the planned stations.csv and targets.csv.
    survey: PathBuf,
    /// Terms that will be estimated, separated by commas; `auto`: all but the amplitude-related ones, each with
    /// what cameras usually show of it where the network does not tell, as `calibrate` has them.
    #[arg(long, default_value = "auto", value_name = "LIST|auto", value_parser = terms)]
    terms: Terms,
    /// What will carry the datum: inner constraints on the targets, or the standard deviations in the tables.
    #[arg(long, value_enum, default_value_t = DatumName::Given)]
    datum: DatumName,
    /// Output folder; default: out/<name of the survey>-plan.
    #[arg(long, short)]
    out: Option<PathBuf>,
    /// calibration.ron of a like camera; default: the one beside survey.ron, or else the nominal camera.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Standard deviation of a column or row, pixel.
    #[arg(long, default_value_t = 0.05, value_name = "PIXEL", value_parser = positive)]
    sigma_pixel: f64,
    /// Standard deviation of a range, metre.
    #[arg(long, default_value_t = 0.01, value_name = "METRE", value_parser = positive)]
    sigma_range: f64,
    /// Stations whose ranges will be left out.
    #[arg(long, value_delimiter = ',', value_name = "STATIONS", value_parser = name)]
    without_ranges: Vec<String>,
    /// Distances from the middle of the targets at which further stations are tried, metre.
    #[arg(long, value_delimiter = ',', value_name = "METRES", default_value = "1,2,4", value_parser = positive)]
    candidate_distances: Vec<f64>,
}

impl PlanArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> NetworkPlanRequest {
        let out = default_out(&self.survey, "-plan");
        let options = PlanOptions {
            sigma_pixel: self.sigma_pixel,
            sigma_range_m: self.sigma_range,
            terms: selection(self.terms),
            datum: self.datum.datum(),
            without_ranges: self.without_ranges,
            candidates: CandidateGrid { distances_m: self.candidate_distances, ..CandidateGrid::default() },
            ..PlanOptions::default()
        };
        NetworkPlanRequest { survey: self.survey, calibration: self.calibration, options, out: self.out.unwrap_or(out) }
    }
}
