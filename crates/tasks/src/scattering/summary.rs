//! Every figure of an estimation of scattering, by name.

use std::path::PathBuf;

use commands::Judged;
use scattering_deconvolution::{PsfEstimate, Verdict};
use serde::Serialize;
use statistics::quantile;

use crate::scattering::{Captures, ScatteringRequest, Shift};

/// A point spread function and how well it is known.
#[derive(Debug, Clone, Serialize)]
pub struct ScatteringSummary {
    /// Survey with the objects.
    pub with_object: String,
    /// Survey without them.
    pub without_object: String,
    /// The calibration that the point spread function was added to.
    pub calibration: String,
    /// Whether the captures tell, in words.
    pub verdict: String,
    /// Whether they determine every parameter.
    pub determined: bool,
    /// Share of a pixel's light that is scattered in all; `None` where the captures do not tell.
    pub scattered_share: Option<f64>,
    /// Weights and widths, Gaussian by Gaussian.
    pub parameters: Vec<ScatteringParameter>,
    /// Their correlations.
    pub correlation: Vec<Vec<f64>>,
    /// Standard deviation of unit weight.
    pub sigma0: Option<f64>,
    /// Observed numbers less unknowns.
    pub redundancy: i64,
    /// Share of the observed blocks that were rejected or have less than half of their weight.
    pub outlier_share: f64,
    /// Smallest weight of a single Gaussian that would have been found; `None` where no light shows.
    pub detection_limit: Option<f64>,
    /// Numbers of Gaussians that were tried.
    pub candidates: Vec<CandidateGaussians>,
    /// Each frequency of each station.
    pub captures: Vec<ScatteringCapture>,
    /// Median change of the background's ranges by the objects' scattered light, metre, over all stations.
    pub shift_median_m: Option<f64>,
    /// The same after restoration.
    pub shift_restored_median_m: Option<f64>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

impl Judged for ScatteringSummary {}

/// One parameter of the point spread function.
#[derive(Debug, Clone, Serialize)]
pub struct ScatteringParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Estimate.
    pub value: f64,
    /// Standard deviation; zero where the value was held.
    pub sigma: f64,
}

/// A number of Gaussians that was tried.
#[derive(Debug, Clone, Serialize)]
pub struct CandidateGaussians {
    /// Number of Gaussians.
    pub terms: usize,
    /// Schwarz's criterion; the smallest is best.
    pub bic: Option<f64>,
    /// Why it was not taken, however good its criterion.
    pub refused: Option<String>,
}

/// One frequency of one station.
#[derive(Debug, Clone, Serialize)]
pub struct ScatteringCapture {
    /// Station.
    pub station: String,
    /// Position of the frequency.
    pub frequency: usize,
    /// Pixels of the object, its shadow and its rim.
    pub object_pixels: usize,
    /// Block means observed.
    pub blocks: usize,
    /// Block means given up.
    pub rejected_blocks: usize,
    /// Root mean square of the change by the object, amplitude units.
    pub rms_before: Option<f64>,
    /// What the model leaves of it.
    pub rms_after: Option<f64>,
    /// What the model of the other captures alone leaves of it.
    pub rms_held_out: Option<f64>,
    /// Median absolute change of the background's ranges, metre.
    pub shift_median_m: Option<f64>,
    /// The same after restoration.
    pub shift_restored_median_m: Option<f64>,
    /// Why it took no part.
    pub unused: Option<String>,
}

impl ScatteringSummary {
    pub(crate) fn new(
        request: &ScatteringRequest,
        captures: &Captures,
        estimate: &PsfEstimate,
        shifts: &[Shift],
    ) -> Self {
        let correlation = estimate.correlation();
        let all =
            |pick: fn(&Shift) -> &[f64]| median_absolute_m(shifts.iter().flat_map(|shift| pick(shift).iter().copied()));
        Self {
            with_object: request.with_object.display().to_string(),
            without_object: request.without_object.display().to_string(),
            calibration: captures.calibration_words.clone(),
            verdict: estimate.verdict.to_string(),
            determined: matches!(estimate.verdict, Verdict::Determined | Verdict::NothingToCorrect),
            scattered_share: estimate.psf.as_ref().map(scattering_deconvolution::Psf::total_weight),
            parameters: estimate.parameters.iter().map(ScatteringParameter::new).collect(),
            correlation: correlation.row_iter().map(|row| row.iter().copied().collect()).collect(),
            sigma0: finite(estimate.sigma0),
            redundancy: estimate.redundancy,
            outlier_share: estimate.outlier_share,
            detection_limit: finite(estimate.detection_limit),
            candidates: estimate.candidates.iter().map(CandidateGaussians::new).collect(),
            captures: captures_of(captures, estimate, shifts),
            shift_median_m: all(|shift| &shift.observed_mm),
            shift_restored_median_m: all(|shift| &shift.restored_mm),
            seconds: 0.0,
            out: request.out.clone(),
        }
    }
}

impl ScatteringParameter {
    fn new(parameter: &scattering_deconvolution::PsfParameter) -> Self {
        let name = parameter.name.clone();
        Self { unit: unit_of(&name), name, value: parameter.value, sigma: parameter.sigma }
    }
}

/// Weights are shares, widths are in pixels.
pub(crate) fn unit_of(name: &str) -> &'static str {
    if name.starts_with("weight") { "1" } else { "px" }
}

impl CandidateGaussians {
    fn new(candidate: &scattering_deconvolution::Candidate) -> Self {
        Self {
            terms: candidate.terms,
            bic: finite(candidate.bic),
            refused: candidate.refused.map(|reason| reason.to_string()),
        }
    }
}

fn captures_of(captures: &Captures, estimate: &PsfEstimate, shifts: &[Shift]) -> Vec<ScatteringCapture> {
    let capture = |report: &scattering_deconvolution::CaptureReport| {
        let shift = shifts.get(report.capture).filter(|_| report.channel == 0);
        ScatteringCapture {
            station: captures.stations.get(report.capture).cloned().unwrap_or_default(),
            frequency: report.channel,
            object_pixels: report.source_pixels,
            blocks: report.blocks,
            rejected_blocks: report.rejected_blocks,
            rms_before: finite(report.rms_before),
            rms_after: finite(report.rms_after),
            rms_held_out: report.rms_held_out,
            shift_median_m: shift.and_then(|shift| median_absolute_m(shift.observed_mm.iter().copied())),
            shift_restored_median_m: shift.and_then(|shift| median_absolute_m(shift.restored_mm.iter().copied())),
            unused: report.unused.map(|reason| reason.to_string()),
        }
    };
    estimate.captures.iter().map(capture).collect()
}

/// Of millimetres, NaN left out.
fn median_absolute_m(values_mm: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values_mm.map(|value| 1e-3 * value.abs()).collect();
    finite(quantile(&mut values, 0.5))
}

fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}
