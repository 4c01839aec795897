//! Every figure of a run, by name; written as `summary.json` and shown as words.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::run::files::clouds::OwnCloud;
use crate::survey::drift::ViewDrift;
use crate::survey::records::{RefusedStage, StageSummary};
use crate::survey::truth::RangeTruth;
use crate::trends::RemainingErrors;
use commands::tiles::TiledCloud;
use commands::{Doubt, Judged, Verdict};

/// What a run did and how good the result is.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Name of the pipeline.
    pub pipeline: String,
    /// The survey's folder.
    pub survey: String,
    /// The calibration that was applied, or why there was none.
    pub calibration: String,
    /// Input level of the frames.
    pub level: &'static str,
    /// Columns and rows.
    pub size_px: [usize; 2],
    /// Frames read.
    pub frames: usize,
    /// Stations seen.
    pub stations: usize,
    /// The stages that ran, in order.
    pub stages: Vec<StageSummary>,
    /// What the ranges of each view had drifted by, where a drift was taken off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drifts: Vec<ViewDrift>,
    /// Stages that this input level rules out, and why.
    pub ruled_out: BTreeMap<String, String>,
    /// Fraction of all pixels that carry each flag; `any` counts pixels with at least one.
    pub flags_fraction: BTreeMap<String, f64>,
    /// Points in the cloud.
    pub points: usize,
    /// Median standard deviation of the unflagged ranges, metre.
    pub sigma_range_median_m: Option<f64>,
    /// How the stations were brought together.
    pub registration: Option<RegistrationSummary>,
    /// Comparison with the camera's own or another reference range.
    pub reference: Option<ReferenceSummary>,
    /// Comparison with the truth of a simulated survey.
    pub truth: Option<TruthSummary>,
    /// Whether what is left of the errors of the ranges is random.
    pub remaining: RemainingErrors,
    /// The stage that the data refused, behind which none ran; what stands without it was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refusal: Option<RefusedStage>,
    /// Clouds in the frames of their own cameras, where there is no common one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub own_clouds: Vec<OwnCloud>,
    /// The common cloud in tiles, where it has so many points that these take the place of `cloud.ply`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tiles: Option<TiledCloud>,
    /// What a reader should know before the result is used.
    pub doubts: Vec<Doubt>,
    /// Wall-clock time of the whole run, second; 0 where durations are left out.
    pub seconds: f64,
    /// The output folder.
    pub out: String,
}

/// Poses and how well they are known.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RegistrationSummary {
    /// Pairs of stations that were aligned.
    pub pairs: Vec<PairSummary>,
    /// Pairs of frames that overlap and were left out, each with its reason.
    pub refused: Vec<String>,
    /// A-posteriori standard deviation of unit weight of the simultaneous adjustment.
    pub sigma0: Option<f64>,
    /// Redundancy of the simultaneous adjustment.
    pub redundancy: Option<i64>,
    /// Largest standard deviation of a station's position, metre, prior-scaled.
    pub position_sigma_max_m: Option<f64>,
}

/// One aligned pair.
#[derive(Debug, Clone, Serialize)]
pub struct PairSummary {
    /// The station held.
    pub target: String,
    /// The station moved.
    pub source: String,
    /// Fraction of the source's points with a partner.
    pub overlap: f64,
    /// Root mean square distance of the partners along the normals, metre.
    pub rms_m: f64,
    /// Iterations needed.
    pub iterations: usize,
    /// Distance between the two perspective centres, metre.
    pub distance_m: f64,
}

/// Ranges held against a second opinion.
#[derive(Debug, Clone, Serialize)]
pub struct ReferenceSummary {
    /// The constant between both, metre.
    pub constant_m: f64,
    /// Robust standard deviation of the differences about the constant, metre.
    pub robust_standard_deviation_m: f64,
    /// Pixels compared.
    pub pixels: usize,
}

/// The whole result against the truth.
#[derive(Debug, Clone, Serialize)]
pub struct TruthSummary {
    /// All stations together.
    #[serde(flatten)]
    pub ranges: RangeTruth,
    /// Largest error of a station's position, metre; of registered surveys only.
    pub position_error_max_m: Option<f64>,
    /// Largest error of a station's attitude, degree.
    pub attitude_error_max_deg: Option<f64>,
    /// The same for each station.
    pub stations: BTreeMap<String, StationTruth>,
}

/// One station against the truth.
#[derive(Debug, Clone, Serialize)]
pub struct StationTruth {
    /// Its ranges.
    #[serde(flatten)]
    pub ranges: RangeTruth,
    /// Error of its position, metre.
    pub position_error_m: Option<f64>,
    /// Error of its attitude, degree.
    pub attitude_error_deg: Option<f64>,
}

impl Judged for Summary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    fn verdict(&self) -> Verdict {
        match &self.refusal {
            Some(_) => Verdict::Partial,
            None if self.doubts.is_empty() => Verdict::Done,
            None => Verdict::Doubtful,
        }
    }
}
