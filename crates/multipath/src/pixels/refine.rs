//! Gauss-Newton with Levenberg's damping on the two paths of one pixel.

use crate::numbers::cholesky::Cholesky;
use crate::pixels::model::{NormalEquations, Parameters, Prior, chi_squared, normal_equations};
use crate::pixels::pixel::Pixel;

/// A minimum of the weighted squares.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    pub parameters: Parameters,
    /// Inverse of the normal matrix: the covariance if the weights are right.
    pub covariance: [[f64; 4]; 4],
    pub chi_squared: f64,
}

impl Fit {
    pub fn sigma(&self, index: usize) -> f64 {
        self.covariance[index][index].sqrt()
    }

    /// Variance of the difference of two parameters.
    pub fn difference_variance(&self, i: usize, j: usize) -> f64 {
        self.covariance[i][i] + self.covariance[j][j] - 2.0 * self.covariance[i][j]
    }
}

const MOST_STEPS: usize = 60;
/// The decrease of chi-squared that a further step would bring, below which the minimum is reached: a thousandth of a
/// standard deviation.
const NEGLIGIBLE: f64 = 1e-6;
/// The same relative to the weighted squares of the measurements: below it, chi-squared is rounding.
const ROUNDING: f64 = 1e-14;

/// Follows the weighted squares from a start to their minimum with both amplitudes positive and `r1 < r2`.
///
/// Where there is none - the way leads to the border of what is allowed, or the squares are flat - it gives the least
/// squares that it came to.
pub(crate) fn refine(pixel: &Pixel, start: Parameters, priors: &[Prior; 2]) -> Result<Fit, f64> {
    let mut parameters = start;
    let mut normal = normal_equations(pixel, &parameters, priors);
    let squares: f64 = pixel.terms().iter().map(|term| term.weight * term.square()).sum();
    let negligible = NEGLIGIBLE + ROUNDING * squares;
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        if let Some(fit) = at_minimum(&parameters, &normal, negligible) {
            return Ok(fit);
        }
        let Some(factor) = Cholesky::new(&damped(&normal.matrix, damping)) else { break };
        let step = factor.solve(&normal.right);
        let trial: Parameters = std::array::from_fn(|i| parameters[i] + step[i]);
        if is_allowed(&trial) && chi_squared(pixel, &trial, priors) < normal.chi_squared {
            parameters = trial;
            normal = normal_equations(pixel, &parameters, priors);
            damping = (damping * 0.1).max(1e-9);
        } else if damping > 1e8 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    Err(normal.chi_squared)
}

/// The fit, if the undamped step from here would change next to nothing.
fn at_minimum(parameters: &Parameters, normal: &NormalEquations, negligible: f64) -> Option<Fit> {
    let factor = Cholesky::new(&normal.matrix)?;
    let step = factor.solve(&normal.right);
    let decrease: f64 = step.iter().zip(&normal.right).map(|(step, right)| step * right).sum();
    (decrease < negligible).then(|| Fit {
        parameters: *parameters,
        covariance: factor.inverse(),
        chi_squared: normal.chi_squared,
    })
}

fn damped(matrix: &[[f64; 4]; 4], damping: f64) -> [[f64; 4]; 4] {
    let mut damped = *matrix;
    for (i, row) in damped.iter_mut().enumerate() {
        row[i] *= 1.0 + damping;
    }
    damped
}

fn is_allowed(&[a, b, r1, r2]: &Parameters) -> bool {
    a > 0.0 && b > 0.0 && r1 < r2
}
