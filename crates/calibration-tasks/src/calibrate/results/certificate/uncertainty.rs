//! Expanded uncertainty (k = 2) of what is measured with the calibration, at chosen places.

use range_io::calibration::Calibration;
use self_calibration::{CalibrationOutcome, Component, ObservationQuality, Verdict};
use serde::Serialize;
use statistics::quantile;

use crate::calibrate::point_uncertainty::PointUncertainty;

/// Coverage factor: about 95 % of a normal distribution.
pub(crate) const COVERAGE: f64 = 2.0;
/// The amplitude at a range is the median of this part of the observed ranges, those nearest to it.
const NEAREST: f64 = 0.1;

/// Expanded uncertainties (k = 2) at one place of the image and one range, metre.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExpandedUncertainty {
    /// Place: `centre`, `middle of the right edge` or `lower right corner`.
    pub place: &'static str,
    /// Its column and row.
    pub pixel: [f64; 2],
    /// Range.
    pub range_m: f64,
    /// Amplitude that was taken, the median of what was observed about that range; `None` where none was observed.
    pub amplitude: Option<f64>,
    /// Of a corrected range, by the calibration alone.
    pub range_by_calibration_m: f64,
    /// Of a point in the camera's frame (root of the trace of its covariance), by the calibration alone.
    pub point_by_calibration_m: f64,
    /// Of the range of one frame, noise included; `None` where the noise of ranges is not known.
    pub range_m_with_noise: Option<f64>,
    /// Of the point of one frame, noise along the ray included.
    pub point_m_with_noise: Option<f64>,
}

/// Uncertainties at centre, edge and corner of the image, at the near, middle and far end of the observed ranges; empty
/// where no range was observed or nothing was estimated.
pub(crate) fn expanded(outcome: &CalibrationOutcome, file: &Calibration) -> Vec<ExpandedUncertainty> {
    let used = |quality: &&ObservationQuality| {
        quality.component == Component::Range && matches!(quality.verdict, Verdict::Used | Verdict::Uncontrolled)
    };
    let ranges: Vec<&ObservationQuality> = outcome.residuals.iter().filter(used).collect();
    let source = PointUncertainty { camera: &outcome.camera, range_models: &outcome.range_models };
    let moved = source.moved(&outcome.estimated, &outcome.first_order_covariance);
    let Some([near, far]) = file.span.range_m.filter(|_| !moved.is_empty() && !ranges.is_empty()) else {
        return Vec::new();
    };
    // Where observations scatter more than stated, so does what follows from them.
    let scale = COVERAGE * outcome.sigma0.unwrap_or(1.0).max(1.0);
    let format = outcome.camera.format;
    let [right, bottom] = [format.width, format.height].map(|count| count as f64 - 1.0);
    let places = [
        ("centre", [right / 2.0, bottom / 2.0]),
        ("middle of the right edge", [right, bottom / 2.0]),
        ("lower right corner", [right, bottom]),
    ];
    let mut all = Vec::new();
    for range_m in [near, f64::midpoint(near, far), far] {
        let amplitude = amplitude_near(&ranges, range_m);
        let noise = file.range_noise.map(|noise| COVERAGE * noise.sigma_m(amplitude, range_m));
        for (place, pixel) in places {
            let sigma = moved.at(pixel, range_m, amplitude);
            let (range, point) = (scale * sigma.range_m, scale * sigma.point_m);
            let with = |part: f64| noise.map(|noise| part.hypot(noise)).filter(|sum| sum.is_finite());
            all.push(ExpandedUncertainty {
                place,
                pixel,
                range_m,
                amplitude: Some(amplitude).filter(|amplitude| amplitude.is_finite()),
                range_by_calibration_m: range,
                point_by_calibration_m: point,
                range_m_with_noise: with(range),
                point_m_with_noise: with(point),
            });
        }
    }
    all
}

fn amplitude_near(ranges: &[&ObservationQuality], range_m: f64) -> f64 {
    let mut by_distance: Vec<(f64, f64)> =
        ranges.iter().map(|quality| ((quality.range_m - range_m).abs(), quality.amplitude)).collect();
    by_distance.sort_by(|a, b| a.0.total_cmp(&b.0));
    by_distance.truncate((NEAREST * ranges.len() as f64).ceil() as usize);
    quantile(&mut by_distance.iter().map(|(_, amplitude)| *amplitude).collect::<Vec<_>>(), 0.5)
}
