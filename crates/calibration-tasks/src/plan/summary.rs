//! Every figure of a plan, by name, as file and as words.

use std::path::{Path, PathBuf};

use camera_model::euler_from_pose;
use commands::Judged;
use self_calibration::{Candidate, PlanOutcome};
use serde::Serialize;

use crate::calibrate::{CorrelationSummary, ParameterMap};
use crate::plan::run::NetworkPlanRequest;

/// What a planned network promises.
#[derive(Debug, Clone, Serialize)]
pub struct PlanSummary {
    /// The survey's folder.
    pub survey: String,
    /// Where the camera came from.
    pub start: String,
    /// Whether a calibration would accept the network.
    pub accepted: bool,
    /// Observed values.
    pub observations: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Redundancy.
    pub redundancy: i64,
    /// How many times worse the weakest combination is known than its parameters would be alone; `None` where nothing
    /// determines it.
    pub inflation: Option<f64>,
    /// All parameters with their expected deviations; posterior ones do not exist yet.
    pub parameters: ParameterMap,
    /// Correlations of the parameters to be estimated.
    pub correlation: CorrelationSummary,
    /// What is weak and what would cure it.
    pub diagnosis: Vec<String>,
    /// Targets in the image of each station: name and number.
    pub sightings_per_station: Vec<(String, usize)>,
    /// What the calibration's uncertainty means for a point.
    pub point_sigma: Vec<PointSigma>,
    /// Further stations, the most helpful first.
    pub candidates: Vec<CandidateSummary>,
    /// The output folder.
    pub out: PathBuf,
}

impl Judged for PlanSummary {}

/// Uncertainty of a point at a range.
#[derive(Debug, Clone, Serialize)]
pub struct PointSigma {
    /// Range, metre.
    pub range_m: f64,
    /// Standard deviation in space, mean over the image, metre.
    pub sigma_m: f64,
}

/// A station that could be added.
#[derive(Debug, Clone, Serialize)]
pub struct CandidateSummary {
    /// Where it is, in words.
    pub description: String,
    /// Perspective centre, metre.
    pub position_m: [f64; 3],
    /// Attitude: omega, phi, kappa, degree.
    pub attitude_deg: [f64; 3],
    /// Targets in its image.
    pub targets: usize,
    /// Mean of the logarithms of the gains; the smaller, the more it helps.
    pub score: f64,
    /// Deviation of each parameter with the station over that without it.
    pub gain: Vec<(String, f64)>,
}

impl PlanSummary {
    pub(crate) fn new(survey: String, start: String, outcome: &PlanOutcome, request: &NetworkPlanRequest) -> Self {
        let point = |&(range_m, sigma_m): &(f64, f64)| PointSigma { range_m, sigma_m };
        Self {
            survey,
            start,
            accepted: outcome.inflation <= request.options.largest_inflation,
            observations: outcome.observations,
            unknowns: outcome.unknowns,
            redundancy: outcome.redundancy,
            inflation: Some(outcome.inflation),
            parameters: ParameterMap::new(&outcome.parameters),
            correlation: CorrelationSummary::new(&outcome.estimated, &outcome.covariance),
            diagnosis: outcome.diagnosis.clone(),
            sightings_per_station: outcome.sightings_per_station.clone(),
            point_sigma: outcome.point_sigma_m.iter().map(point).collect(),
            candidates: outcome.candidates.iter().map(candidate).collect(),
            out: request.out.clone(),
        }
    }

    /// What is left to say where the network was refused: why, and no parameter.
    pub(crate) fn refused(survey: String, start: String, reason: String, out: &Path) -> Self {
        Self {
            survey,
            start,
            accepted: false,
            observations: 0,
            unknowns: 0,
            redundancy: 0,
            inflation: None,
            parameters: ParameterMap::default(),
            correlation: CorrelationSummary::default(),
            diagnosis: vec![reason],
            sightings_per_station: Vec::new(),
            point_sigma: Vec::new(),
            candidates: Vec::new(),
            out: out.to_owned(),
        }
    }
}

fn candidate(candidate: &Candidate) -> CandidateSummary {
    CandidateSummary {
        description: candidate.description.clone(),
        position_m: candidate.world_from_camera.translation.vector.into(),
        attitude_deg: euler_from_pose(&candidate.world_from_camera).map(f64::to_degrees),
        targets: candidate.targets,
        score: candidate.score,
        gain: candidate.gain.clone(),
    }
}
