//! Start values for h1, h2, h3 from residuals against amplitude.

use error_models::AmplitudeHyperbola;

use crate::{Error, Result};

/// Number of amplitude classes that the residuals are averaged in.
const CLASSES: usize = 24;

/// Value at amplitude zero, as multiples of the largest class mean.
const HEIGHTS: [f64; 7] = [1.0, 1.3, 2.0, 3.0, 5.0, 10.0, 20.0];

/// Level at large amplitudes, from the last class mean by multiples of the spread of the class means.
const LEVELS: [f64; 7] = [0.5, 0.2, 0.0, -0.2, -0.5, -1.0, -2.0];

/// The best hyperbola of a coarse grid over three readable numbers: value `Z` at amplitude zero, level `L` at large
/// amplitudes, and slope `p`; then `h3 = 1 / Z²`, `h2 = p h3`, `h1 = −L h2`.
pub(crate) fn hyperbola_start(samples: &mut [(f64, f64)], amplitude_span: [f64; 2]) -> Result<[f64; 3]> {
    let classes = class_means(samples);
    if classes.len() < 3 {
        return Err(Error::NoHyperbola { reason: "fewer than three different amplitudes" });
    }
    let means = || classes.iter().map(|(_, residual)| *residual);
    let (lowest, highest) = means().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), r| (l.min(r), h.max(r)));
    let (spread, last) = (highest - lowest, classes[classes.len() - 1].1);
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

/// Mean amplitude and residual of classes of equal size, ascending; equal amplitudes are not told apart.
fn class_means(samples: &mut [(f64, f64)]) -> Vec<(f64, f64)> {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut classes: Vec<(f64, f64)> = samples
        .chunks(samples.len().div_ceil(CLASSES).max(1))
        .map(|class| {
            let count = class.len() as f64;
            let sum = class.iter().fold((0.0, 0.0), |sum, sample| (sum.0 + sample.0, sum.1 + sample.1));
            (sum.0 / count, sum.1 / count)
        })
        .collect();
    classes.dedup_by(|a, b| (a.0 - b.0).abs() <= 1e-9 * b.0.abs());
    classes
}

fn geometric(first: f64, last: f64) -> impl Iterator<Item = f64> {
    let steps = 24;
    let ratio = (last / first).powf(1.0 / f64::from(steps));
    (0..=steps).map(move |step| first * ratio.powi(step))
}

/// Sum of squares against the class means; infinite where the hyperbola has no value.
fn misfit(classes: &[(f64, f64)], [h1, h2, h3]: [f64; 3], amplitude_span: [f64; 2]) -> f64 {
    let hyperbola = AmplitudeHyperbola { h1, h2, h3, amplitude_span };
    let square = |(amplitude, residual): &(f64, f64)| {
        hyperbola.correction(*amplitude).map_or(f64::INFINITY, |value| (value - residual).powi(2))
    };
    classes.iter().map(square).sum()
}
