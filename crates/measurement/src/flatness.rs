//! How flat a region is, beyond the noise of its points.

use point_uncertainty::Gradient;
use statistics::{Distribution, SIGMA_OF_MAD, mad_scale};

use crate::FittedPlane;
use crate::quantity::LEVEL;

/// How far points lie from their plane, and what of it is no noise.
///
/// The range of residuals grows with the number of points of a perfect plane; it is not stated. Form is a root mean square over the
/// points that were kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Flatness {
    /// Robust standard deviation of the points across the plane, metre.
    pub spread_m: f64,
    /// What it would be of a perfect plane with the stated errors of each point, metre.
    pub noise_m: f64,
    /// Root mean square form deviation beyond noise, metre; zero where noise explains all.
    pub form_m: f64,
    /// Its standard deviation, metre; NaN where the form is zero.
    pub sigma_m: f64,
    /// Two-sided 95 % interval of the form deviation, metre.
    pub interval_m: [f64; 2],
    /// Probability of so much scatter or more on a perfect plane.
    pub probability: f64,
    /// Derivatives of the form deviation by points; empty where it is zero.
    pub gradient: Gradient,
}

/// Flatness of the region that a plane was fitted to.
///
/// The weighted sum of squared residuals has the expectation `tr Q + f² S`, with Q their covariance from noise, neighbourhoods
/// and common errors, f the root mean square form, and S the sum of weights less what the fit takes; its variance is
/// `2 tr Q² + 4 f² S tr Q² / tr Q` (the form lies in what is known as well as residuals are on average).
pub fn flatness(plane: &FittedPlane) -> Flatness {
    let support = &plane.support;
    let weights = || support.sigmas_m.iter().map(|sigma| (sigma * sigma).recip());
    let sum: f64 =
        support.residuals_m.iter().zip(weights()).map(|(residual, weight)| residual * residual * weight).sum();
    let per_form: f64 = weights().zip(&support.redundancies).map(|(weight, left)| weight * left).sum();
    let [mean, squares] = support.expected;
    let square = (sum - mean) / per_form;
    let sigma_of = |square: f64| (2.0 * squares + 4.0 * square.max(0.0) * per_form * squares / mean).sqrt() / per_form;
    let form_m = square.max(0.0).sqrt();
    let mut absolute: Vec<f64> = support.residuals_m.iter().map(|residual| residual.abs()).collect();
    Flatness {
        spread_m: mad_scale(&mut absolute),
        noise_m: expected_spread(&support.sigmas_m, &support.redundancies),
        form_m,
        sigma_m: if form_m > 0.0 { sigma_of(square) / (2.0 * form_m) } else { f64::NAN },
        interval_m: interval(square, sigma_of),
        probability: support.scatter.probability,
        gradient: gradient(plane, form_m, per_form),
    }
}

/// Forms of which the found square is neither too small nor too large at half the level; their variance is taken at the form.
fn interval(square: f64, sigma_of: impl Fn(f64) -> f64) -> [f64; 2] {
    let critical = Distribution::Normal.critical(LEVEL);
    let end = |sign: f64| {
        // Fixed point of `form² = found ± critical · sigma(form²)`, which contracts: sigma grows with the root.
        let mut form_square = square.max(0.0);
        for _ in 0..FIXED_POINT_ROUNDS {
            form_square = (square + sign * critical * sigma_of(form_square)).max(0.0);
        }
        form_square.sqrt()
    };
    [end(-1.0), end(1.0)]
}

/// Rounds after which the ends of an interval stand still to a thousandth of its width.
const FIXED_POINT_ROUNDS: usize = 50;

/// Robust standard deviation of values of which each has its own: where half of all moduli are expected below.
fn expected_spread(sigmas: &[f64], redundancies: &[f64]) -> f64 {
    let own: Vec<f64> = sigmas.iter().zip(redundancies).map(|(sigma, left)| sigma * left.max(0.0).sqrt()).collect();
    let (mut low, mut high) = (0.0, own.iter().copied().fold(0.0, f64::max));
    let half = 0.5 * own.len() as f64;
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        let within: f64 = own.iter().map(|sigma| 1.0 - Distribution::Normal.p_value(middle / sigma)).sum();
        if within < half { low = middle } else { high = middle }
    }
    SIGMA_OF_MAD * f64::midpoint(low, high)
}

/// Of `f² = (Σ e² / V − tr Q) / S`: what the fit takes is orthogonal to the residuals.
fn gradient(plane: &FittedPlane, form_m: f64, per_form: f64) -> Gradient {
    let support = &plane.support;
    if form_m <= 0.0 {
        return Vec::new();
    }
    let values = support.residuals_m.iter().zip(&support.sigmas_m);
    let by = values.map(|(residual, sigma)| residual / (sigma * sigma * per_form * form_m));
    let all = support.kept.iter().zip(support.normals()).zip(by);
    all.map(|((point, normal), by)| (*point, normal * by)).collect()
}
