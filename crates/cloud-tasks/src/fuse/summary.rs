//! What was fused, by name.

use std::collections::BTreeMap;
use std::path::PathBuf;

use commands::{Doubt, Judged};
use serde::Serialize;

/// A fused cloud in figures.
#[derive(Debug, Clone, Default, Serialize)]
pub struct FuseSummary {
    /// Folder of the result that was fused.
    pub result: String,
    /// The calibration that the common errors name.
    pub calibration: Option<String>,
    /// Spacing of the fused points, metre.
    pub voxel_m: f64,
    /// Common errors that took part.
    pub common_errors: usize,
    /// `estimated` and taken off the points, or `as_stated`.
    pub common_error_use: &'static str,
    /// Where the points of the result went.
    pub points: CountedPoints,
    /// Fused points.
    pub fused_points: usize,
    /// Points that are in none, by reason: `seen_through`, `behind`, `off_surface`, `outvoted`, `between`, `at_edge`, `uneven`,
    /// `alone`.
    pub unfused: BTreeMap<&'static str, usize>,
    /// Fused points that a frame saw through, with those that were given up for it.
    pub contradicted_points: usize,
    /// Of these the ones that were given up, since more frames spoke against them than for them.
    pub outvoted_points: usize,
    /// Surfaces that cannot both be there, by pair of frames.
    pub contradictions: Vec<ContradictionSummary>,
    /// Stations that do not fit the others.
    pub apart: Vec<ApartSummary>,
    /// Standard deviations of the fused points along their normals.
    pub sigma: Option<SigmaSummary>,
    /// How far points lie off the surfaces.
    pub thickness: Option<ThicknessSummary>,
    /// The error that all frames of a depth camera share; missing where it was not looked for, or does not show.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shared_error: Option<SharedErrorSummary>,
    /// By how many times the variance of the points' noise is larger than stated, as most surfaces show; 1 where it is not.
    pub noise_factor: f64,
    /// The variance of points about planes within single frames over what is stated of their noise.
    pub noise_within_frames: f64,
    /// What was found of the other common errors.
    pub corrections: Vec<Correction>,
    /// What a reader should know, in sentences.
    pub findings: Vec<String>,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
    /// Why nothing was fused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// Time taken.
    pub seconds: f64,
    /// Where it was written.
    pub out: PathBuf,
    /// Names of the files of the fused points, and of those that are in none.
    pub clouds: [String; 2],
}

/// Where the points of a result went.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct CountedPoints {
    /// Points of the cloud.
    pub all: usize,
    /// Points with a flag, which take no part.
    pub flagged: usize,
    /// Points without position or standard deviation.
    pub unusable: usize,
    /// Points that the fused ones were made of.
    pub fused: usize,
}

/// Surfaces of two frames that cannot both be there.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ContradictionSummary {
    /// The frame that saw the surface in front.
    pub front: String,
    /// The frame that saw another one through it.
    pub seen_through_by: String,
    /// Pairs of fused points.
    pub pairs: usize,
    /// Median distance, metre.
    pub median_distance_m: f64,
    /// Largest distance over its standard deviation.
    pub largest_deviations: f64,
}

/// A station whose pose does not agree with its covariance and the surfaces of the others.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ApartSummary {
    /// Its frames.
    pub frames: Vec<String>,
    /// Frames that see the same surfaces elsewhere.
    pub others: Vec<String>,
    /// Probability of such a disagreement where the covariance is true, corrected for all stations.
    pub p_value: f64,
    /// By how much its pose would have to change: metre and radian.
    pub shifts: Vec<(String, f64)>,
}

/// Standard deviations of fused points along their normals, from all sources.
#[derive(Debug, Clone, Default, Serialize)]
pub struct SigmaSummary {
    /// Half of them are below, metre.
    pub median_m: f64,
    /// Nineteen of twenty are below, metre.
    pub below_95_m: f64,
    /// Mean shares of the variance: by source, `disagreement` for what frames differ by beyond what the sources state, and `shape` for
    /// surfaces that are bent. They add up to one.
    pub shares: BTreeMap<&'static str, f64>,
}

/// Robust standard deviations of points across the planes of their fused points, metre.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct ThicknessSummary {
    /// As the result has them.
    pub before_m: f64,
    /// With what was found of the common errors taken off.
    pub after_m: f64,
    /// What noise alone gives.
    pub noise_m: f64,
    /// What noise gives with what neighbouring pixels share, were that drawn anew for each point.
    pub noise_and_sensor_m: f64,
    /// Points that were counted: those of fused points of at least three.
    pub points: usize,
}

/// The error that all frames of a depth camera share, smooth over the image, in inverse depth: as depth it grows with the squared depth.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct SharedErrorSummary {
    /// Standard deviation over cameras of that kind, as surfaces tell it: of a depth of one metre, metre.
    pub sigma_at_1_m: f64,
    /// Distance in the image at which the correlation is 1/e, pixel.
    pub length_px: f64,
    /// Logarithm of the likelihood of all that frames see together over that without the error.
    pub evidence: f64,
    /// Root mean square of what was taken off at the nodes of its grid, of a depth of one metre, metre.
    pub taken_off_rms_m: f64,
    /// The same of the standard deviations of what remains.
    pub sigma_after_rms_m: f64,
}

/// What was found of one common error.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Correction {
    /// Its name.
    pub name: String,
    /// `calibration`, `drift` or `poses`.
    pub source: &'static str,
    /// What was taken off, in its unit.
    pub value: f64,
    /// Standard deviation as stated.
    pub sigma_before: f64,
    /// Standard deviation of what remains.
    pub sigma_after: f64,
}

impl Judged for FuseSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}
