//! Whether the standard deviation of a direct range can be relied on.
//!
//! A short detour with a strong second path and a longer one with a weak second path look nearly alike: the squares
//! have a long, bent valley, and the curvature at its lowest point says nothing of its length. So the direct range is
//! held at a few standard deviations from its best value, all else is adjusted again, and the squares must have risen as
//! they do in a parabola.

use crate::pixels::model::Prior;
use crate::pixels::pixel::Pixel;
use crate::pixels::refine::{Fit, refine};

/// Distance from the best direct range in standard deviations, and the share of its square by which chi-squared must rise.
const PROBES: [(f64, f64); 4] = [(-3.0, 0.6), (3.0, 0.6), (-6.0, 0.5), (6.0, 0.5)];
/// Weight by which a range is held, relative to its own.
const HOLD: f64 = 1e6;

/// Whether chi-squared rises about the minimum as the standard deviation of the direct range says.
pub(crate) fn is_sigma_reliable(pixel: &Pixel, fit: &Fit) -> bool {
    let sigma = fit.sigma(2);
    PROBES.into_iter().all(|(distance, share)| {
        let shift = distance * sigma;
        let held = Prior { range_m: fit.parameters[2] + shift, weight: HOLD / (sigma * sigma) };
        // The start is where the parabola has its minimum for that range.
        let column = fit.covariance[2];
        let start = std::array::from_fn(|i| fit.parameters[i] + column[i] / column[2] * shift);
        let profile = refine(pixel, start, &[held, Prior::default()]);
        profile.is_ok_and(|profile| profile.chi_squared - fit.chi_squared > share * distance * distance)
    })
}
