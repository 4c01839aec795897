//! The drift as an optical reference inside the camera shows it (Sect. 4.7).

use error_models::{FixedPattern, InterpolatedModel};
use range_image::{Flags, ImageFormat, Modulation, RangeFrame};
use range_io::survey::ReferencePath;
use statistics::{quantile, robust_standard_deviation};

use crate::survey::drift::{DriftSource, ViewDrift};
use commands::DriftError;

/// Where the pixels of a camera are, and their own offsets.
pub(crate) struct Sensor<'a> {
    pub(crate) format: ImageFormat,
    pub(crate) principal_point_mm: [f64; 2],
    pub(crate) pattern: Option<&'a FixedPattern>,
}

/// Fewer pixels have no mean with a standard deviation that is worth the name.
const FEWEST_PIXELS: usize = 4;

/// Pixels further from the median than so many robust standard deviations are left out.
const OUTLIER_SIGMAS: f64 = 4.0;

/// Rounding of a range in single precision that robust statistics of equal values must survive, metre.
const ROUNDING_M: f64 = 1e-6;

/// The mean of what the pixels of the reference show too much, their calibrated errors taken off: of all frequencies,
/// by their weights. `frames` are those of `view` before the correction.
pub(crate) fn drift(
    view: String,
    path: &ReferencePath,
    frames: &[(&RangeFrame, &InterpolatedModel, Option<Modulation>)],
    sensor: &Sensor<'_>,
) -> Result<ViewDrift, DriftError> {
    let (mut weight, mut sum) = (0.0, 0.0);
    for (frame, model, modulation) in frames {
        let (mean_m, variance) =
            robust_mean(differences(path, frame, model, *modulation, sensor), pixels(path).count())?;
        weight += 1.0 / variance;
        sum += mean_m / variance;
    }
    let (drift_m, sigma_m) = (sum / weight, weight.powf(-0.5));
    Ok(ViewDrift { view, drift_m, sigma_m, source: DriftSource::ReferencePath, frame_rate: None })
}

/// Takes the pixels of the reference out of a frame: they do not see the scene.
pub(crate) fn mask(path: &ReferencePath, frame: &mut RangeFrame) {
    for pixel in pixels(path) {
        frame.range[pixel] = f32::NAN;
        frame.flags[pixel].insert(Flags::NO_DATA);
    }
}

/// Column and row of its pixels.
fn pixels(path: &ReferencePath) -> impl Iterator<Item = (usize, usize)> {
    let ([left, right], [top, bottom]) = (path.columns, path.rows);
    (top..=bottom).flat_map(move |row| (left..=right).map(move |col| (col, row)))
}

/// Corrected ranges minus the length of the path.
fn differences(
    path: &ReferencePath,
    frame: &RangeFrame,
    model: &InterpolatedModel,
    modulation: Option<Modulation>,
    sensor: &Sensor<'_>,
) -> Vec<f64> {
    let unusable = Flags::SATURATED | Flags::LOW_AMPLITUDE | Flags::MOTION | Flags::NO_DATA;
    let [xp, yp] = sensor.principal_point_mm;
    let difference = |(col, row): (usize, usize)| {
        let range_m = f64::from(frame.range[(col, row)]);
        if !range_m.is_finite() || frame.flags[(col, row)].intersects(unusable) {
            return None;
        }
        // Whole intervals come from unwrapping over a border that is none in the scene.
        let whole_m = modulation.map_or(0.0, |modulation| {
            let interval_m = modulation.ambiguity_interval_m();
            ((range_m - path.length_m) / interval_m).round() * interval_m
        });
        let (range_m, amplitude) = (range_m - whole_m, f64::from(frame.amplitude[(col, row)]));
        let [x, y] = sensor.format.image_from_pixel([col as f64, row as f64]);
        let correction = model.correction(range_m, x - xp, y - yp, amplitude);
        let index = row * sensor.format.width + col;
        let own_m = sensor.pattern.and_then(|pattern| pattern.offset_m.get(index)).copied().map_or(0.0, f64::from);
        Some(range_m - correction.total_m() - own_m - path.length_m).filter(|_| !correction.outside_span)
    };
    pixels(path).filter_map(difference).collect()
}

/// Mean without outliers, and its variance by the scatter of what is left.
fn robust_mean(mut values: Vec<f64>, pixels: usize) -> Result<(f64, f64), DriftError> {
    values.retain(|value| value.is_finite());
    let limit = OUTLIER_SIGMAS * robust_standard_deviation(&values) + ROUNDING_M;
    let centre = quantile(&mut values.clone(), 0.5);
    values.retain(|value| (value - centre).abs() <= limit);
    let usable = values.len();
    if usable < FEWEST_PIXELS {
        return Err(DriftError::Reference { usable, pixels, needed: FEWEST_PIXELS });
    }
    let count = usable as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Ok((mean, (squares / (count - 1.0)).max(ROUNDING_M * ROUNDING_M) / count))
}
