//! Whether what a calibration leaves of the ranges is random.

use error_models::FixedPattern;
use pipeline::trends::TrendSummary;
use residual_tests::{TrendOptions, TrendSample, test_trends};
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};

/// The residuals of ranges, a table of offsets taken off, against range, amplitude, column and row; empty where there are
/// too few of them.
pub(crate) fn trends(outcome: &CalibrationOutcome, table: Option<&FixedPattern>) -> Vec<TrendSummary> {
    let used = outcome.residuals.iter().filter(|q| q.component == Component::Range && q.verdict == Verdict::Used);
    let mut stations: Vec<&str> = Vec::new();
    let mut samples = Vec::new();
    for quality in used.filter(|quality| quality.pixel.iter().all(|place| place.is_finite())) {
        let station = stations.iter().position(|name| *name == quality.station).unwrap_or_else(|| {
            stations.push(&quality.station);
            stations.len() - 1
        });
        let [col, row] = quality.pixel.map(|place| place.round() as usize);
        let offset = table.and_then(|table| table.offset_m.get(row * table.width + col)).map_or(0.0, |m| f64::from(*m));
        samples.push(TrendSample { residual_m: quality.residual - offset, ..sample(quality, station) });
    }
    // Too few samples for any bins, the only thing that may be refused of used residuals.
    let report = test_trends(&samples, &TrendOptions::default());
    report.map_or_else(|_| Vec::new(), |report| report.tests.iter().map(TrendSummary::new).collect())
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
