//! What a laboratory signs: who calibrated which camera under which conditions from which files, what every test says, for
//! what the calibration holds, and how uncertain what is measured with it is. Computed once; pages print it.

pub(crate) mod digest;
pub(crate) mod elements;
pub(crate) mod hold_out;
pub(crate) mod pairs;
pub(crate) mod uncertainty;
pub(crate) mod verdicts;

use range_io::calibration::Calibration;
use self_calibration::{CalibrationOutcome, ObservationQuality, Verdict};
use serde::Serialize;

pub use crate::calibrate::start::conditions::Conditions;
pub use commands::InputDigest;
pub use elements::{CertifiedStation, CertifiedTarget, Observed};
pub use hold_out::{HeldOut, HeldOutCheck, HeldOutPart};
pub use pairs::NotoriousPair;
pub use uncertainty::ExpandedUncertainty;
pub use verdicts::TestVerdict;

pub(crate) use crate::calibrate::start::conditions::extent;
pub(crate) use pairs::{is_notorious, notorious_pairs};
pub(crate) use uncertainty::COVERAGE;

use crate::calibrate::{CalibrateRequest, CalibrationSummary, Start};
use pipeline::Result;

/// Everything on a certificate but its date.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// Program and version.
    pub software: String,
    /// Camera and conditions, as the survey states them; the operator may be that of the request.
    pub conditions: Conditions,
    /// Integration times that range terms were found for, second; empty where none is known.
    pub integration_times_s: Vec<f64>,
    /// What is known of warming up, in words.
    pub warm_up: String,
    /// Files that were read.
    pub inputs: Vec<InputDigest>,
    /// What every test says.
    pub verdicts: Vec<TestVerdict>,
    /// For what the calibration holds, in words.
    pub span: Vec<String>,
    /// Expanded uncertainties (k = 2) at chosen places.
    pub expanded_uncertainty: Vec<ExpandedUncertainty>,
    /// The check on stations left out.
    pub hold_out: HeldOut,
    /// Correlations of pairs that are hard to separate.
    pub notorious_pairs: Vec<NotoriousPair>,
    /// The stations.
    pub stations: Vec<CertifiedStation>,
    /// The targets.
    pub targets: Vec<CertifiedTarget>,
}

/// What a certificate is made from.
pub(crate) struct Source<'a> {
    pub(crate) request: &'a CalibrateRequest,
    pub(crate) start: &'a Start,
    pub(crate) outcome: &'a CalibrationOutcome,
    pub(crate) file: &'a Calibration,
    pub(crate) hold_out: HeldOut,
}

impl Certificate {
    pub(crate) fn new(source: Source<'_>, summary: &CalibrationSummary) -> Result<Self> {
        let Source { request, start, outcome, file, hold_out } = source;
        let mut conditions = start.conditions.clone();
        conditions.operator = request.certificate.operator.clone().or(conditions.operator);
        let integration_times_s: Vec<f64> = outcome.range_models.iter().filter_map(|(time, _)| *time).collect();
        Ok(Self {
            software: format!("rangecam {}", env!("CARGO_PKG_VERSION")),
            span: span(outcome, file, &integration_times_s, &conditions),
            warm_up: warm_up(start, &conditions),
            conditions,
            integration_times_s,
            inputs: digest::digests(request)?,
            verdicts: verdicts::verdicts(outcome, summary, &hold_out),
            expanded_uncertainty: uncertainty::expanded(outcome, file),
            hold_out,
            notorious_pairs: notorious_pairs(&summary.correlation),
            stations: elements::stations(outcome),
            targets: elements::targets(outcome),
        })
    }
}

fn warm_up(start: &Start, conditions: &Conditions) -> String {
    let since =
        conditions.since_power_on_s.map(|[from, to]| format!("frames from {from:.0} s to {to:.0} s after power-on"));
    let drift = crate::calibrate::start::drift::sentence(&start.drifts);
    let known: Vec<String> = since.into_iter().chain(drift).collect();
    if known.is_empty() { "not given".to_owned() } else { known.join("; ") }
}

fn span(outcome: &CalibrationOutcome, file: &Calibration, times_s: &[f64], conditions: &Conditions) -> Vec<String> {
    let mut words = Vec::new();
    match file.span.range_m {
        Some([from, to]) => words.push(format!("ranges of {from:.3} m to {to:.3} m, as observed")),
        None => words.push("no ranges: the range terms are those of the start values".to_owned()),
    }
    if let Some([from, to]) = file.span.amplitude {
        words.push(format!("amplitudes of {from:.1} to {to:.1}"));
    }
    let used = || {
        let is_used = |of: &&ObservationQuality| matches!(of.verdict, Verdict::Used | Verdict::Uncontrolled);
        outcome.residuals.iter().filter(is_used)
    };
    let pixels = |axis: usize| extent(used().map(|quality| quality.pixel[axis]));
    if let (Some([left, right]), Some([top, bottom])) = (pixels(0), pixels(1)) {
        let [width, height] = conditions.image_px;
        words.push(format!(
            "image points of columns {left:.1} to {right:.1} and rows {top:.1} to {bottom:.1} of {width} x {height} pixels"
        ));
    }
    let times: Vec<String> = times_s.iter().map(|time| format!("{time} s")).collect();
    words.push(match times.as_slice() {
        [] => "integration time not given: frames that state one need a calibration that does".to_owned(),
        [one] => format!("an integration time of {one}"),
        several => format!("integration times of {}, and between them", several.join(", ")),
    });
    words.push(match conditions.temperature_c {
        Some([from, to]) => format!("temperatures of {from:.1} to {to:.1} degrees Celsius, as the frames state"),
        None => "temperature not given: the calibration holds for that of the survey".to_owned(),
    });
    words
}
