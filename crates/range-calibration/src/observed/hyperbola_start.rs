//! Start values for h1, h2, h3 from residuals against amplitude.

use error_models::AmplitudeHyperbola;
use statistics::{mad_scale, upper_median};

use crate::{Error, Result};

/// Number of amplitude classes; the median of each class keeps gross errors out.
const CLASSES: usize = 24;
/// Weight of the median of normal values beside their mean: 2 / π.
const WEIGHT_OF_MEDIAN: f64 = std::f64::consts::FRAC_2_PI;

/// Value at amplitude zero, as multiples of the largest class median.
const HEIGHTS: [f64; 7] = [1.0, 1.3, 2.0, 3.0, 5.0, 10.0, 20.0];

/// Level at large amplitudes, from the last class median by multiples of the spread of the class medians.
const LEVELS: [f64; 7] = [0.5, 0.2, 0.0, -0.2, -0.5, -1.0, -2.0];

/// The best hyperbola of a coarse grid over three readable numbers: value `Z` at amplitude zero, level `L` at large
/// amplitudes, and slope `p`; then `h3 = 1 / Z²`, `h2 = p h3`, `h1 = −L h2`. Samples are amplitudes with residuals in metres, and
/// are sorted; the span has the smallest and the largest amplitude.
///
/// # Errors
/// [`Error::NoHyperbola`] where the residuals do not depend on the amplitude, or show fewer than three amplitudes.
pub fn hyperbola_start(samples: &mut [(f64, f64)], amplitude_span: [f64; 2]) -> Result<[f64; 3]> {
    let classes = class_medians(samples);
    if classes.len() < 3 {
        return Err(Error::NoHyperbola { reason: "fewer than three different amplitudes" });
    }
    let medians = || classes.iter().map(|class| class.residual);
    let (lowest, highest) = medians().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(r), h.max(r)));
    let (spread, last) = (highest - lowest, classes[classes.len() - 1].residual);
    let height = highest.abs().max(spread);
    if height <= 0.0 {
        return Err(Error::NoHyperbola { reason: "the residuals do not depend on the amplitude" });
    }
    let mut best = (f64::INFINITY, None);
    for z in HEIGHTS.map(|factor| factor * height) {
        for level in LEVELS.map(|factor| last + factor * spread) {
            // The knee lies near the amplitude Z / p: from a hundredth of the smallest to ten times the largest.
            for knee in geometric(0.01 * amplitude_span[0].max(1e-6 * amplitude_span[1]), 10.0 * amplitude_span[1]) {
                let h3 = 1.0 / (z * z);
                let h2 = z / knee * h3;
                let candidate = [-level * h2, h2, h3];
                let misfit = misfit(&classes, candidate, amplitude_span);
                if misfit < best.0 {
                    best = (misfit, Some(candidate));
                }
            }
        }
    }
    best.1.ok_or(Error::NoHyperbola { reason: "no hyperbola has a value at all amplitudes" })
}

/// By how much a hyperbola lowers the sum of squares of the residuals, in variances: chi-squared of three degrees of freedom
/// where they do not depend on the amplitude.
pub fn hyperbola_gain(samples: &mut [(f64, f64)], hyperbola: &AmplitudeHyperbola) -> f64 {
    let classes = class_medians(samples);
    let of_class = |amplitude: f64| classes.iter().rev().find(|class| class.lowest <= amplitude);
    let off =
        samples.iter().filter_map(|(amplitude, residual)| Some((residual - of_class(*amplitude)?.residual).abs()));
    let variance = mad_scale(&mut off.collect::<Vec<f64>>()).powi(2);
    let count = classes.iter().map(|class| class.count).sum::<f64>();
    let mean = classes.iter().map(|class| class.count * class.residual).sum::<f64>() / count;
    let square = |class: &Class| {
        let value = hyperbola.correction(class.amplitude).map_or(f64::INFINITY, |value| value - class.residual);
        class.count * ((class.residual - mean).powi(2) - value.powi(2))
    };
    WEIGHT_OF_MEDIAN * classes.iter().map(square).sum::<f64>() / variance
}

/// Residuals of about equal amplitude.
struct Class {
    /// Least and mean amplitude.
    lowest: f64,
    amplitude: f64,
    /// Median.
    residual: f64,
    count: f64,
}

/// Classes of equal size, ascending; equal amplitudes are not told apart.
fn class_medians(samples: &mut [(f64, f64)]) -> Vec<Class> {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let class = |class: &[(f64, f64)]| {
        let count = class.len() as f64;
        let amplitude = class.iter().map(|sample| sample.0).sum::<f64>() / count;
        let residual = upper_median(&mut class.iter().map(|sample| sample.1).collect::<Vec<f64>>());
        Class { lowest: class[0].0, amplitude, residual, count }
    };
    let mut classes: Vec<Class> = samples.chunks(samples.len().div_ceil(CLASSES).max(1)).map(class).collect();
    classes.dedup_by(|a, b| (a.amplitude - b.amplitude).abs() <= 1e-9 * b.amplitude.abs());
    classes
}

fn geometric(first: f64, last: f64) -> impl Iterator<Item = f64> {
    let steps = 24;
    let ratio = (last / first).powf(1.0 / f64::from(steps));
    (0..=steps).map(move |step| first * ratio.powi(step))
}

/// Sum of squares against the class medians; infinite where the hyperbola has no value.
fn misfit(classes: &[Class], [h1, h2, h3]: [f64; 3], amplitude_span: [f64; 2]) -> f64 {
    let hyperbola = AmplitudeHyperbola { h1, h2, h3, amplitude_span };
    let square = |class: &Class| {
        hyperbola.correction(class.amplitude).map_or(f64::INFINITY, |value| (value - class.residual).powi(2))
    };
    classes.iter().map(square).sum()
}
