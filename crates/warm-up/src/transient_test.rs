//! Whether there is one exponential more, and whether the drift follows the frame rate.

use statistics::Distribution;

use crate::fitting::curve::{Curve, RateSteps};
use crate::fitting::projection::{Basis, dot};
use crate::fitting::whitening::Whitening;

/// Test of one exponential more beside a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransientTest {
    /// Exponentials of the model that it was tested beside.
    pub beside: usize,
    /// Share of the remaining sum of squares that it explains at its best time constant, 0 to 1.
    pub explained: f64,
    /// That time constant, second; `None` where nothing is left that an exponential could explain.
    pub time_constant_s: Option<f64>,
    /// Probability of so much where there is none, whatever time constant is sought out.
    pub p_value: f64,
    /// Whether the model has it: it is significant, and its time constant could be fitted and is longer than a block.
    pub taken: bool,
}

/// Test of a part of the drift that follows the frame rate, beside transients of any time constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameRateTest {
    /// Share of the remaining sum of squares that it explains at its best time constant, 0 to 1.
    pub explained: f64,
    /// That time constant, second; `None` where nothing is left that it could explain.
    pub time_constant_s: Option<f64>,
    /// Probability of so much where the drift does not follow the frame rate, whatever time constant is sought out.
    pub p_value: f64,
    /// Whether the model has it: it is significant, and its time constant could be fitted.
    pub taken: bool,
}

/// One exponential more beside a model (whitened design: `model`).
pub(crate) fn test(
    curve: &Curve<'_>,
    whitening: &Whitening,
    model: &Basis,
    residuals: Vec<f64>,
    beside: usize,
) -> TransientTest {
    let (explained, time_constant_s, p_value) =
        search(curve, whitening, model, residuals, |tau| curve.exponential(tau, whitening));
    TransientTest { beside, explained, time_constant_s, p_value, taken: false }
}

/// A response to the frame rate beside a model.
pub(crate) fn test_rate(
    curve: &Curve<'_>,
    rate: &RateSteps<'_>,
    whitening: &Whitening,
    model: &Basis,
    level: f64,
) -> FrameRateTest {
    let observed = whitening.column(curve.observed());
    let (explained, time_constant_s, p_value) =
        search(curve, whitening, model, observed, |tau| curve.rate_response(rate, tau, whitening));
    FrameRateTest { explained, time_constant_s, p_value, taken: p_value < level && time_constant_s.is_some() }
}

/// Seeks the time constant whose column explains most of the residuals of a model: the share that it explains, the time
/// constant, and the probability of so much.
///
/// Where there is no such part, the direction of the residuals is uniform on the sphere of m dimensions beside the
/// model, and the unit vectors of the columns of all time constants are a curve on it. The probability to come within
/// an angle of this curve of length `L` or its mirror image is that of a tube (`[Hotelling1939]`):
/// `p = L/π (1 − w²)^((m−2)/2) + P(|t| > w √((m−1) / (1−w²)))`, w the cosine. A plain F test with two numerator
/// degrees of freedom, which forgets the search, finds several times as many exponentials as its level says.
fn search(
    curve: &Curve<'_>,
    whitening: &Whitening,
    model: &Basis,
    residuals: Vec<f64>,
    column: impl Fn(f64) -> Vec<f64>,
) -> (f64, Option<f64>, f64) {
    let residuals = model.residual(residuals);
    let square = dot(&residuals, &residuals);
    let (mut length, mut best) = (0.0, (0.0, None));
    let mut before: Option<Vec<f64>> = None;
    for time_constant_s in curve.grid() {
        let Some(direction) = model.direction(column(time_constant_s)) else { continue };
        if let Some(before) = &before {
            length += dot(before, &direction).clamp(-1.0, 1.0).acos();
        }
        let explained = dot(&direction, &residuals).powi(2) / square;
        if explained > best.0 {
            best = (explained, Some(time_constant_s));
        }
        before = Some(direction);
    }
    let (explained, time_constant_s) = best;
    let m = whitening.len() as f64 - model.rank() as f64;
    let left = (1.0 - explained).max(f64::MIN_POSITIVE);
    let tube = length / std::f64::consts::PI * left.powf(0.5 * (m - 2.0));
    let ends = Distribution::StudentT { dof: m - 1.0 }.p_value((explained * (m - 1.0) / left).sqrt());
    (explained, time_constant_s, (tube + ends).min(1.0))
}
