//! Whether a region is the primitive that was fitted, and enough of it.

use std::collections::BTreeMap;

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
    let residuals: BTreeMap<[usize; 2], f64> = fit
        .pixels
        .iter()
        .filter(|pixel| pixel.used)
        .map(|pixel| (pixel.position, (pixel.observed_m - pixel.modelled_m) / pixel.sigma_m))
        .collect();
    let (mut products, mut pairs) = (0.0, 0.0);
    for (&[col, row], own) in &residuals {
        for neighbour in [[col + step, row], [col, row + step]] {
            if let Some(other) = residuals.get(&neighbour) {
                products += own * other;
                pairs += 1.0;
            }
        }
    }
    let square = residuals.values().map(|own| own * own).sum::<f64>() / residuals.len().max(1) as f64;
    let common: f64 = products / pairs;
    if common > 4.0 * square / f64::sqrt(pairs) { common.sqrt() } else { 0.0 }
}
