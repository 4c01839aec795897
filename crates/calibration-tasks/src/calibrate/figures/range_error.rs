//! Range errors against range, before and after the calibration.

use error_models::RangeErrorModel;
use report::{Axes, CATEGORIES, Canvas, Figure, robust_span, span};
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};
use statistics::quantile;

use crate::calibrate::point_uncertainty::{PointUncertainty, amplitude_of};

const SIZE: [f64; 2] = [590.0, 340.0];
const STEPS: usize = 160;
/// Half width of a 95 % interval in standard deviations.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Figures before and after; empty where no range was used.
pub(crate) fn figures(outcome: &CalibrationOutcome) -> Vec<(Figure, String)> {
    let used = |quality: &&ObservationQuality| {
        quality.component == Component::Range && matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled)
    };
    let ranges: Vec<&ObservationQuality> = outcome.residuals.iter().filter(used).collect();
    let Some((_, model)) = outcome.range_models.first() else { return Vec::new() };
    if ranges.is_empty() {
        return Vec::new();
    }
    let x = span(ranges.iter().map(|quality| quality.range_m));
    vec![before(outcome, model, &ranges, x), after(&ranges, x)]
}

fn before(
    outcome: &CalibrationOutcome,
    model: &RangeErrorModel,
    ranges: &[&ObservationQuality],
    x: [f64; 2],
) -> (Figure, String) {
    let points: Vec<(f64, f64)> = ranges.iter().map(|quality| (quality.range_m, 1e3 * quality.uncorrected_m)).collect();
    let curve = curve(outcome, model, x);
    let y = robust_span(points.iter().map(|point| point.1).chain(curve.iter().flat_map(|(_, v, s)| [v - s, v + s])));
    let axes = Axes { title: "Before: errors and the model", x: "observed range, m", y: "range error, mm" };
    let mut canvas = Canvas::new(&axes, SIZE, x, y);
    let band: Vec<_> = curve.iter().map(|(x, v, s)| (*x, v - NORMAL_95 * s, v + NORMAL_95 * s)).collect();
    let drawn = canvas.cloud(&points, CATEGORIES[1], 0.4);
    canvas.band(&band, CATEGORIES[0], 0.3);
    canvas.line(&curve.iter().map(|(x, v, _)| (*x, *v)).collect::<Vec<_>>(), CATEGORIES[0], "");
    canvas.name(CATEGORIES[1], "observed minus adjusted distance");
    canvas.name(CATEGORIES[0], "model, 95 % band");
    let caption = format!(
        "The curve is the estimated correction at the principal point and at the median amplitude; its band follows \
         from the covariance of the parameters. Rms before: {:.1} mm.{}",
        1e3 * rms(ranges.iter().map(|quality| quality.uncorrected_m)),
        drawn.words()
    );
    (canvas.finish(), caption)
}

fn after(ranges: &[&ObservationQuality], x: [f64; 2]) -> (Figure, String) {
    let points: Vec<(f64, f64)> = ranges.iter().map(|quality| (quality.range_m, 1e3 * quality.residual)).collect();
    let band = expected(ranges, x);
    let y = robust_span(points.iter().map(|point| point.1).chain(band.iter().flat_map(|(_, low, high)| [*low, *high])));
    let axes = Axes { title: "After: residuals", x: "observed range, m", y: "range residual, mm" };
    let mut canvas = Canvas::new(&axes, SIZE, x, y);
    canvas.band(&band, CATEGORIES[7], 0.2);
    let drawn = canvas.cloud(&points, CATEGORIES[2], 0.45);
    canvas.name(CATEGORIES[2], "residual");
    canvas.name(CATEGORIES[7], "95 % of the stated noise");
    let inside = ranges.iter().filter(|quality| quality.residual.abs() <= NORMAL_95 * quality.sigma).count();
    let caption = format!(
        "{:.1} % of the residuals lie within 1.96 of their own stated standard deviations. Rms after: {:.1} mm.{}",
        100.0 * inside as f64 / ranges.len() as f64,
        1e3 * rms(ranges.iter().map(|quality| quality.residual)),
        drawn.words()
    );
    (canvas.finish(), caption)
}

/// Model and its standard deviation along the range, millimetre.
fn curve(outcome: &CalibrationOutcome, model: &RangeErrorModel, x: [f64; 2]) -> Vec<(f64, f64, f64)> {
    let amplitude = amplitude_of(outcome);
    let everywhere = RangeErrorModel { range_span_m: None, ..model.clone() };
    let uncertainty = PointUncertainty { camera: &outcome.camera, range_models: &outcome.range_models };
    let at = |step: usize| x[0] + (x[1] - x[0]) * step as f64 / STEPS as f64;
    let places: Vec<f64> = (0..=STEPS).map(at).collect();
    let sigmas = uncertainty.correction_sigmas(&outcome.estimated, &outcome.first_order_covariance, &places, amplitude);
    let value = |range_m: f64| 1e3 * everywhere.correction(range_m, 0.0, 0.0, amplitude).total_m();
    places.iter().zip(sigmas).map(|(range_m, sigma)| (*range_m, value(*range_m), 1e3 * sigma)).collect()
}

/// The band that the given standard deviations promise, from their median in each part of the span, millimetre.
fn expected(ranges: &[&ObservationQuality], [low, high]: [f64; 2]) -> Vec<(f64, f64, f64)> {
    const PARTS: usize = 12;
    let width = (high - low) / PARTS as f64;
    let mut band = Vec::new();
    for part in 0..PARTS {
        let (from, to) = (low + width * part as f64, low + width * (part + 1) as f64);
        let within = ranges.iter().filter(|quality| (from..to).contains(&quality.range_m));
        let half = NORMAL_95 * 1e3 * quantile(&mut within.map(|quality| quality.sigma).collect::<Vec<_>>(), 0.5);
        if half.is_finite() {
            band.extend([(from, -half, half), (to, -half, half)]);
        }
    }
    band
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let finite = values.filter(|value| value.is_finite());
    let (sum, count) = finite.fold((0.0, 0_usize), |(sum, count), value| (sum + value * value, count + 1));
    (sum / count.max(1) as f64).sqrt()
}
