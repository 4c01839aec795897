//! The range corrections that two models make, with the band that their covariances leave.

use error_models::{AmplitudeHyperbola, RangeErrorModel};
use nalgebra::DMatrix;
use range_image::ImageFormat;

use super::{deviation, estimated, require_covariance, require_level, simultaneous_factor};
use crate::{Error, Result};

/// Ranges, amplitudes, and columns and rows of the image that the functions are compared at.
const RANGES: usize = 96;
const AMPLITUDES: usize = 12;
const PLACES: usize = 5;

/// A model with the covariance of its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionSide<'a> {
    /// The model.
    pub model: &'a RangeErrorModel,
    /// Covariance of all parameters: those of [`RangeErrorModel::parameter_names`], then h1, h2, h3 where there is a
    /// hyperbola.
    pub covariance: DMatrix<f64>,
    /// Principal point (xp, yp), millimetre.
    pub principal_point_mm: [f64; 2],
}

/// The difference of the corrections at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrectionDifference {
    /// Observed range, metre.
    pub range_m: f64,
    /// Amplitude, camera's unit; NaN where neither model asks for it.
    pub amplitude: f64,
    /// Column and row.
    pub pixel: [f64; 2],
    /// Correction of the second model minus that of the first, metre.
    pub difference_m: f64,
    /// Half the width of the band that holds everywhere at once, metre.
    pub band_m: f64,
}

/// What the different parameters do to ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionComparison {
    /// Ranges that both models cover, metre; NaN-free.
    pub range_span_m: [f64; 2],
    /// Amplitudes that both cover; `None` where neither asks for it.
    pub amplitude_span: Option<[f64; 2]>,
    /// Where the magnitude of the difference is largest.
    pub largest: CorrectionDifference,
    /// Where it is largest in units of its band.
    pub clearest: CorrectionDifference,
    /// Root mean square of the difference over ranges, amplitudes and image, metre.
    pub rms_m: f64,
    /// The difference along the range, in the image's centre at a medium amplitude.
    pub along_range: Vec<CorrectionDifference>,
    /// Whether the difference leaves its band anywhere.
    pub significant: bool,
}

/// Compares the corrections of two models over the ranges, amplitudes and image that both cover.
///
/// The band holds for all places at once at this level: parameters are correlated, so that they may differ where the
/// correction does not `[Scheffe1953]`.
///
/// # Errors
/// [`Error::NotComparable`] where the spans have nothing in common; [`Error::OutOfDomain`] for covariance and level.
pub fn compare_corrections(
    first: &CorrectionSide<'_>,
    second: &CorrectionSide<'_>,
    format: &ImageFormat,
    level: f64,
) -> Result<CorrectionComparison> {
    require_level(level)?;
    for side in [first, second] {
        require_covariance(&side.covariance, side.names().len())?;
    }
    let range_span_m = common_ranges(first.model, second.model)?;
    let amplitude_span = common_amplitudes(first.model, second.model)?;
    let names = [first, second].map(CorrectionSide::names);
    let free = estimated([(&names[0], &first.covariance), (&names[1], &second.covariance)]);
    let factor = simultaneous_factor(free, level);
    let at = |range_m: f64, amplitude: f64, pixel: [f64; 2]| -> CorrectionDifference {
        let [one, other] = [first, second].map(|side| side.at(format, range_m, amplitude, pixel));
        let band_m = factor * one[1].hypot(other[1]);
        CorrectionDifference { range_m, amplitude, pixel, difference_m: other[0] - one[0], band_m }
    };
    let amplitudes = amplitude_span.map_or_else(|| vec![f64::NAN], |span| geometric(span, AMPLITUDES));
    let edges = [format.width, format.height].map(|size| linear([0.0, size.saturating_sub(1) as f64], PLACES));
    let ranges = linear(range_span_m, RANGES);
    let middle = [edges[0][PLACES / 2], edges[1][PLACES / 2]];
    let along_range: Vec<_> =
        ranges.iter().map(|&range_m| at(range_m, amplitudes[amplitudes.len() / 2], middle)).collect();
    let (mut largest, mut clearest) = (along_range[0], along_range[0]);
    let (mut squares, mut count) = (0.0, 0_usize);
    for &range_m in &ranges {
        for &amplitude in &amplitudes {
            for pixel in edges[0].iter().flat_map(|&col| edges[1].iter().map(move |&row| [col, row])) {
                let here = at(range_m, amplitude, pixel);
                (squares, count) = (squares + here.difference_m.powi(2), count + 1);
                if here.difference_m.abs() > largest.difference_m.abs() {
                    largest = here;
                }
                if here.clarity() > clearest.clarity() {
                    clearest = here;
                }
            }
        }
    }
    let rms_m = (squares / count as f64).sqrt();
    let significant = clearest.clarity() > 1.0;
    Ok(CorrectionComparison { range_span_m, amplitude_span, largest, clearest, rms_m, along_range, significant })
}

impl CorrectionDifference {
    /// The difference in units of its band; without a band any difference is infinite.
    fn clarity(&self) -> f64 {
        /// What rounding leaves of equal models, metre.
        const ROUNDING_M: f64 = 1e-12;
        if self.difference_m.abs() <= ROUNDING_M { 0.0 } else { self.difference_m.abs() / self.band_m }
    }
}

impl CorrectionSide<'_> {
    fn names(&self) -> Vec<String> {
        let hyperbola = self.model.hyperbola.iter().flat_map(|_| AmplitudeHyperbola::NAMES.map(str::to_owned));
        self.model.parameter_names().into_iter().chain(hyperbola).collect()
    }

    /// Correction and its standard deviation, metre.
    fn at(&self, format: &ImageFormat, range_m: f64, amplitude: f64, pixel: [f64; 2]) -> [f64; 2] {
        let [x, y] = format.image_from_pixel(pixel);
        let (x, y) = (x - self.principal_point_mm[0], y - self.principal_point_mm[1]);
        let mut gradient = self.model.design_row(range_m, x, y);
        let mut value: f64 = gradient.iter().zip(self.model.parameter_values()).map(|(d, value)| d * value).sum();
        if let Some(hyperbola) = &self.model.hyperbola {
            value += hyperbola.correction(amplitude).unwrap_or(0.0);
            gradient.extend(hyperbola.jacobian(amplitude).map_or([0.0; 3], |jacobian| jacobian.coefficients));
        }
        [value, deviation(&self.covariance, &gradient)]
    }
}

fn common_ranges(first: &RangeErrorModel, second: &RangeErrorModel) -> Result<[f64; 2]> {
    let polynomial = |model: &RangeErrorModel| model.further.polynomial.as_ref().map(|terms| terms.range_span_m);
    let spans = [first.range_span_m, second.range_span_m, polynomial(first), polynomial(second)];
    // Where no span is known one ambiguity interval stands for all.
    let known: Vec<[f64; 2]> = spans.into_iter().flatten().collect();
    if known.is_empty() {
        return Ok([0.0, first.ambiguity_interval_m]);
    }
    intersection("ranges", known.into_iter())
}

fn common_amplitudes(first: &RangeErrorModel, second: &RangeErrorModel) -> Result<Option<[f64; 2]>> {
    let spans = [first, second].into_iter().filter_map(|model| model.hyperbola.map(|h| h.amplitude_span));
    let known: Vec<[f64; 2]> = spans.collect();
    if known.is_empty() { Ok(None) } else { intersection("amplitudes", known.into_iter()).map(Some) }
}

pub(super) fn intersection(what: &str, spans: impl Iterator<Item = [f64; 2]>) -> Result<[f64; 2]> {
    let common = spans.fold([f64::NEG_INFINITY, f64::INFINITY], |[l, h], span| [l.max(span[0]), h.min(span[1])]);
    if common[0] < common[1] {
        return Ok(common);
    }
    let needs = format!(
        "{what} that both calibrations cover; the one ends at {:.4}, the other begins at {:.4}",
        common[1], common[0]
    );
    Err(Error::NotComparable { comparison: "comparison", needs })
}

pub(super) fn linear([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    (0..count).map(|k| low + (high - low) * k as f64 / (count - 1) as f64).collect()
}

/// Equal ratios; amplitudes may begin at zero.
fn geometric([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    let start = low.max(1e-4 * high);
    let mut values: Vec<f64> =
        (0..count).map(|k| (start * (high / start).powf(k as f64 / (count - 1) as f64)).clamp(low, high)).collect();
    values[0] = low;
    values
}
