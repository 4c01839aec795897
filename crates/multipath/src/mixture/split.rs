//! A pixel's light shared out between two surfaces.

use crate::mixture::mixed::{NotSplit, SplitPixel, SurfacePoint};
use crate::mixture::surfaces::{Continued, Sides};
use crate::pixels::model::{Parameters, Prior};
use crate::pixels::pixel::{MAXIMUM_FREQUENCIES, Pixel};
use crate::pixels::refine::{Fit, refine};

/// Least squares over all frequencies, with both continued ranges as observations. Column and row are left at 0.
pub(crate) fn split_complex(
    pixel: &Pixel,
    sides: &Sides,
    thresholds: &[f64; 2 * MAXIMUM_FREQUENCIES],
) -> Result<SplitPixel, NotSplit> {
    let frequencies = pixel.terms().len();
    if frequencies == 0 {
        return Err(NotSplit::NoValue);
    }
    let start = amplitudes(pixel, sides).ok_or(NotSplit::OneSurface)?;
    let prior = |side: &Continued| Prior { range_m: side.range_m, weight: 1.0 / (side.sigma_m * side.sigma_m) };
    let priors = [prior(&sides.foreground), prior(&sides.background)];
    let fit = refine(pixel, start, &priors).map_err(|_| NotSplit::OneSurface)?;
    let freedom = 2 * frequencies - 2;
    if fit.chi_squared > thresholds[freedom] {
        return Err(NotSplit::NotExplained);
    }
    let [a, b, foreground_m, background_m] = fit.parameters;
    let total = a + b;
    let point = |amplitude: f64, range_m: f64, index: usize| SurfacePoint {
        range_m,
        sigma_m: fit.sigma(index),
        share: amplitude / total,
        amplitude,
    };
    Ok(SplitPixel {
        col: 0,
        row: 0,
        foreground: point(a, foreground_m, 2),
        background: point(b, background_m, 3),
        sigma_share: sigma_share(&fit),
        chi_squared: (freedom > 0).then_some(fit.chi_squared),
    })
}

/// Standard deviation of `a / (a + b)`.
fn sigma_share(fit: &Fit) -> f64 {
    let [a, b, ..] = fit.parameters;
    let square = (a + b) * (a + b);
    let (da, db) = (b / square, -a / square);
    let c = &fit.covariance;
    (da * da * c[0][0] + 2.0 * da * db * c[0][1] + db * db * c[1][1]).sqrt()
}

/// The best amplitudes at the continued ranges; `None` unless both are positive.
fn amplitudes(pixel: &Pixel, sides: &Sides) -> Option<Parameters> {
    let (near, far) = (sides.foreground.range_m, sides.background.range_m);
    let (mut total, mut coupling, mut first, mut second) = (0.0, 0.0, 0.0, 0.0);
    for term in pixel.terms() {
        let (sn, cn) = (term.wavenumber * near).sin_cos();
        let (sf, cf) = (term.wavenumber * far).sin_cos();
        total += term.weight;
        coupling += term.weight * (cn * cf + sn * sf);
        first += term.weight * (term.re * cn + term.im * sn);
        second += term.weight * (term.re * cf + term.im * sf);
    }
    let determinant = total * total - coupling * coupling;
    let a = (total * first - coupling * second) / determinant;
    let b = (total * second - coupling * first) / determinant;
    (a > 0.0 && b > 0.0 && a.is_finite() && b.is_finite()).then_some([a, b, near, far])
}

/// From the range alone: `b / a = sin k(r - rf) / sin k(rb - r)`, at `k = 0` the ratio of the distances.
pub(crate) fn split_range(
    range_m: f64,
    sigma_m: f64,
    amplitude: f64,
    wavenumber: f64,
    sides: &Sides,
) -> Result<SplitPixel, NotSplit> {
    if !range_m.is_finite() {
        return Err(NotSplit::NoValue);
    }
    let (near, far) = (&sides.foreground, &sides.background);
    let (from_near, to_far) = (range_m - near.range_m, far.range_m - range_m);
    let sine = |length: f64| if wavenumber > 0.0 { (wavenumber * length).sin() / wavenumber } else { length };
    let whole = sine(far.range_m - near.range_m);
    // Amplitudes relative to the pixel's own: negative where the range is not between the two.
    let (a, b) = (sine(to_far) / whole, sine(from_near) / whole);
    if !(a > 0.0 && b > 0.0 && a.is_finite() && b.is_finite()) {
        return Err(NotSplit::OneSurface);
    }
    let share = b / (a + b);
    // Logarithmic derivatives of b / a: k cot k x, at k = 0 the inverse of x.
    let slope = |length: f64| if wavenumber > 0.0 { wavenumber / (wavenumber * length).tan() } else { 1.0 / length };
    let (by_near, by_far) = (slope(from_near), slope(to_far));
    let parts = [(by_near + by_far) * sigma_m, by_near * near.sigma_m, by_far * far.sigma_m];
    let sigma_share = share * (1.0 - share) * parts.iter().map(|part| part * part).sum::<f64>().sqrt();
    let point = |side: &Continued, share: f64, relative: f64| SurfacePoint {
        range_m: side.range_m,
        sigma_m: side.sigma_m,
        share,
        amplitude: amplitude * relative,
    };
    Ok(SplitPixel {
        col: 0,
        row: 0,
        foreground: point(near, 1.0 - share, a),
        background: point(far, share, b),
        sigma_share,
        chi_squared: None,
    })
}
