//! One path seen by all frequencies: `z = a exp(i k r)`.

use crate::pixels::pixel::Pixel;

/// A minimum of the weighted squares of one path.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SingleFit {
    pub range_m: f64,
    pub sigma_m: f64,
    pub amplitude: f64,
    pub chi_squared: f64,
}

/// Follows `P(r) = Re sum w z exp(-i k r)` from a grid point to its maximum by Newton's method.
///
/// `None` if it does not get there or the amplitude is not positive.
pub(crate) fn refine_single(pixel: &Pixel, start_m: f64) -> Option<SingleFit> {
    let (mut range, highest) = (start_m, pixel.terms().iter().map(|term| term.wavenumber).fold(0.0, f64::max));
    let mut converged = false;
    for _ in 0..30 {
        let [_, slope, curvature] = projection(pixel, range);
        if curvature >= 0.0 {
            return None;
        }
        // A tenth of a radian of the highest frequency is well within the peak.
        let step = (-slope / curvature).clamp(-0.1 / highest, 0.1 / highest);
        range += step;
        if step.abs() < 1e-9 {
            converged = true;
            break;
        }
    }
    let total: f64 = pixel.terms().iter().map(|term| term.weight).sum();
    let stiffness: f64 = pixel.terms().iter().map(|term| term.weight * term.wavenumber * term.wavenumber).sum();
    let amplitude = projection(pixel, range)[0] / total;
    (converged && amplitude > 0.0).then(|| SingleFit {
        range_m: range,
        sigma_m: 1.0 / (amplitude * stiffness.sqrt()),
        amplitude,
        chi_squared: misfit(pixel, range, amplitude),
    })
}

/// `P` and its first two derivatives.
fn projection(pixel: &Pixel, range_m: f64) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for term in pixel.terms() {
        let (sin, cos) = (term.wavenumber * range_m).sin_cos();
        let (along, across) = (term.re * cos + term.im * sin, term.im * cos - term.re * sin);
        sums[0] += term.weight * along;
        sums[1] += term.weight * term.wavenumber * across;
        sums[2] -= term.weight * term.wavenumber * term.wavenumber * along;
    }
    sums
}

fn misfit(pixel: &Pixel, range_m: f64, amplitude: f64) -> f64 {
    let squares = pixel.terms().iter().map(|term| {
        let (sin, cos) = (term.wavenumber * range_m).sin_cos();
        let (re, im) = (term.re - amplitude * cos, term.im - amplitude * sin);
        term.weight * (re * re + im * im)
    });
    squares.sum()
}
