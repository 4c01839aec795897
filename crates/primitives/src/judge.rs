//! Whether a region is the primitive that was fitted, and enough of it.

use crate::{Error, Result};
use crate::{Primitive, PrimitiveFit};

/// Refuses a radius or a direction that the region hardly determines.
pub(crate) fn require_determined(fit: &PrimitiveFit, limit: f64) -> Result<()> {
    let sigma = |index: usize| fit.covariance[(index, index)].sqrt();
    let uncertain = match fit.primitive {
        // m = n / d: across the normal its deviation is that of the direction, times 1 / d.
        Primitive::Plane { distance_m, .. } => {
            let total = fit.covariance.trace().sqrt() * distance_m;
            vec![("direction of the normal", total)]
        }
        Primitive::Sphere { radius_m, .. } => vec![("radius in parts of itself", sigma(3) / radius_m)],
        Primitive::Cylinder { radius_m, .. } => vec![
            ("radius in parts of itself", sigma(4) / radius_m),
            ("direction of the axis", sigma(0).hypot(sigma(1))),
        ],
    };
    match uncertain.into_iter().find(|(_, sigma)| sigma.is_nan() || *sigma > limit) {
        Some((what, sigma)) => Err(Error::PrimitiveNotDetermined { kind: fit.kind, what, sigma, limit }),
        None => Ok(()),
    }
}

/// Root mean square of what residuals of neighbours have in common, in sigmas of a pixel; zero where that is within four
/// deviations of none.
///
/// Random errors of neighbours are independent, so the mean product of their standardised residuals is the variance of
/// whatever is smooth: another shape, scattered light, errors of the lens.
pub(crate) fn systematic_sigmas(fit: &PrimitiveFit, step: usize) -> f64 {
    let used = || fit.pixels.iter().filter(|pixel| pixel.used);
    let last = |axis: usize| used().map(|pixel| pixel.position[axis] + 1).max().unwrap_or(0);
    let (columns, rows) = (last(0), last(1));
    let mut residuals = vec![f64::NAN; columns * rows];
    for pixel in used() {
        let [column, row] = pixel.position;
        residuals[column * rows + row] = (pixel.observed_m - pixel.modelled_m) / pixel.sigma_m;
    }
    let (mut products, mut pairs, mut squares, mut count) = (0.0, 0.0, 0.0, 0_usize);
    for (place, own) in residuals.iter().enumerate().filter(|(_, own)| own.is_finite()) {
        let below = (place % rows + step < rows).then_some(place + step);
        for neighbour in [Some(place + step * rows), below] {
            let other = neighbour.and_then(|place| residuals.get(place)).filter(|other| other.is_finite());
            if let Some(other) = other {
                products += own * other;
                pairs += 1.0;
            }
        }
        squares += own * own;
        count += 1;
    }
    let square = squares / count.max(1) as f64;
    let common: f64 = products / pairs;
    if common > 4.0 * square / f64::sqrt(pairs) { common.sqrt() } else { 0.0 }
}
