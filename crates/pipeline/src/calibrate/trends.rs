//! Whether what a calibration leaves of the ranges is random.

use self_calibration::{
    CalibrationOutcome, Component, ObservationQuality, TrendOptions, TrendSample, TrendTest, TrendVerdict, Verdict,
    test_trends,
};
use serde::Serialize;

/// The test of the residuals against one variable.
#[derive(Debug, Clone, Serialize)]
pub struct TrendSummary {
    /// The variable, with its unit.
    pub variable: &'static str,
    /// `random`, `trend`, or why it was not tested.
    pub verdict: String,
    /// Probability of means as different by chance; `None` where it was not tested.
    pub p_value: Option<f64>,
    /// Root mean square of the trend, chance taken off, metre.
    pub rms_m: Option<f64>,
    /// Middle of each bin, mean residual and its standard error, metre.
    pub bins: Vec<[f64; 3]>,
}

/// The residuals of ranges against range, amplitude, column and row; empty where there are too few of them.
pub(super) fn trends(outcome: &CalibrationOutcome) -> Vec<TrendSummary> {
    let used = outcome.residuals.iter().filter(|q| q.component == Component::Range && q.verdict == Verdict::Used);
    let mut stations: Vec<&str> = Vec::new();
    let mut samples = Vec::new();
    for quality in used.filter(|quality| quality.pixel.iter().all(|place| place.is_finite())) {
        let station = stations.iter().position(|name| *name == quality.station).unwrap_or_else(|| {
            stations.push(&quality.station);
            stations.len() - 1
        });
        samples.push(sample(quality, station));
    }
    // Too few samples for any bins, the only thing that may be refused of used residuals.
    let report = test_trends(&samples, &TrendOptions::default());
    report.map_or_else(|_| Vec::new(), |report| report.tests.iter().map(summary).collect())
}

fn sample(quality: &ObservationQuality, frame: usize) -> TrendSample {
    TrendSample {
        residual_m: quality.residual,
        sigma_m: quality.sigma,
        range_m: quality.range_m,
        amplitude: quality.amplitude,
        column: quality.pixel[0],
        row: quality.pixel[1],
        // Frames of a station are averaged.
        time_s: f64::NAN,
        frame,
    }
}

fn summary(test: &TrendTest) -> TrendSummary {
    let verdict = match test.verdict {
        TrendVerdict::Random => "random".to_owned(),
        TrendVerdict::Trend => "trend".to_owned(),
        TrendVerdict::NotTested(reason) => format!("not tested: {reason}"),
    };
    let finite = |value: f64| Some(value).filter(|value| value.is_finite());
    let bins = test.bins.iter().map(|bin| [f64::midpoint(bin.low, bin.high), bin.mean_m, bin.standard_error_m]);
    TrendSummary {
        variable: test.variable.name(),
        verdict,
        p_value: finite(test.p_value),
        rms_m: finite(test.rms_m),
        bins: bins.collect(),
    }
}

/// One sentence; `None` where nothing was tested.
pub(crate) fn sentence(trends: &[TrendSummary]) -> Option<String> {
    let tested: Vec<&TrendSummary> = trends.iter().filter(|trend| trend.p_value.is_some()).collect();
    if tested.is_empty() {
        return None;
    }
    let found: Vec<String> = tested
        .iter()
        .filter(|trend| trend.verdict == "trend")
        .map(|trend| format!("{} (rms {:.2} mm)", trend.variable, 1e3 * trend.rms_m.unwrap_or(f64::NAN)))
        .collect();
    if found.is_empty() {
        let names: Vec<&str> = tested.iter().map(|trend| trend.variable).collect();
        return Some(format!("the residuals show no trend in {}", names.join(", ")));
    }
    Some(format!("the residuals still depend on {}: the model lacks a term", found.join(", ")))
}
