//! From the corrected image point back to the observed one, and where that has no answer.
//!
//! Let `g(u) = u - D(u)` for an observed point `u` counted from the principal point, `D` the correction, and
//! `J = I - D'` its derivative. As long as the symmetric part of `J` stays positive definite, `g` is one to one: on any
//! segment `(g(b) - g(a))ᵀ (b - a) > 0`. Without shear `J` is symmetric itself; where it first becomes singular the
//! model folds over, and beyond it the same corrected points come again.

use nalgebra::{Matrix2, Vector2};

use crate::LensDistortion;

/// Newton steps allowed. Well inside the fold four to six are taken; close to it, where convergence is linear, some tens.
const MAX_STEPS: usize = 100;

/// Halvings of one step: less than 2^-50 of it is lost in rounding.
const MAX_HALVINGS: usize = 50;

/// A step that shortens the misfit by less than this share is held up by the fold: the point lies beyond it.
const LEAST_GAIN: f64 = 1e-6;

/// Points looked at between the principal point and a point that the quick test leaves open.
const SAMPLES_TO_FOLD: usize = 64;

/// Points looked at along one step, for the same purpose.
const SAMPLES_OF_STEP: usize = 4;

impl LensDistortion {
    /// Whether the model is one to one from the principal point out to `reduced`.
    ///
    /// First a sufficient bound on the whole disc: the norm of `D'` is at most
    /// `3 |k1| r^2 + 5 |k2| r^4 + 7 |k3| r^6 + 6 |p| r + |b|`. Where that reaches 1, `J` is looked at along the segment.
    pub(crate) fn one_to_one_to(&self, reduced: Vector2<f64>) -> bool {
        self.is_mild_within(reduced) || self.is_definite_along(Vector2::zeros(), reduced, SAMPLES_TO_FOLD)
    }

    /// The sufficient bound, on the disc out to a point.
    fn is_mild_within(&self, reduced: Vector2<f64>) -> bool {
        let r2 = reduced.norm_squared();
        let radial = r2 * (3.0 * self.k1.abs() + r2 * (5.0 * self.k2.abs() + r2 * 7.0 * self.k3.abs()));
        radial + 6.0 * self.p1.hypot(self.p2) * r2.sqrt() + self.b1.hypot(self.b2) < 1.0
    }

    /// Whether the symmetric part of `J` is positive definite at samples along a segment, its end among them.
    fn is_definite_along(&self, from: Vector2<f64>, to: Vector2<f64>, samples: usize) -> bool {
        // From the end: there a step meets the fold first.
        (1..=samples).rev().all(|i| {
            let derivative = self.derivative(from + (to - from) * (i as f64 / samples as f64));
            let skew = 0.5 * (derivative.m12 - derivative.m21);
            // The determinant of the symmetric part is smaller by the square of the other part.
            derivative.determinant() > skew * skew && derivative.trace() > 0.0
        })
    }

    /// The observed point of a corrected one, both counted from the principal point: Newton from the principal
    /// point, each step halved until it approaches and stays inside the fold. `None` where there is no such point.
    pub(crate) fn observed_from_corrected(&self, corrected: Vector2<f64>) -> Option<Vector2<f64>> {
        let mut observed = Vector2::zeros();
        let mut misfit = corrected;
        for _ in 0..MAX_STEPS {
            if misfit.norm() <= self.rounding_at(observed, corrected) {
                return self.one_to_one_to(observed).then_some(observed);
            }
            let step = self.derivative(observed).try_inverse()? * misfit;
            let before = misfit.norm();
            (observed, misfit) = self.approach(observed, step, corrected, before)?;
            if misfit.norm() > (1.0 - LEAST_GAIN) * before {
                break;
            }
        }
        None
    }

    /// The longest of the step's halvings that comes closer and stays inside the fold.
    fn approach(
        &self,
        from: Vector2<f64>,
        mut step: Vector2<f64>,
        corrected: Vector2<f64>,
        misfit_before: f64,
    ) -> Option<(Vector2<f64>, Vector2<f64>)> {
        for _ in 0..MAX_HALVINGS {
            let trial = from + step;
            let misfit = corrected - (trial - self.at(trial));
            let is_inside = || self.is_mild_within(trial) || self.is_definite_along(from, trial, SAMPLES_OF_STEP);
            if misfit.norm() < misfit_before && is_inside() {
                return Some((trial, misfit));
            }
            step *= 0.5;
        }
        None
    }

    /// `J = I - D'`: derivative of the corrected with respect to the observed point.
    pub(crate) fn derivative(&self, reduced: Vector2<f64>) -> Matrix2<f64> {
        Matrix2::identity() - self.slope(reduced)
    }

    /// How far rounding alone can put `g(observed)` from `corrected`: some units of the last place of the largest term.
    fn rounding_at(&self, observed: Vector2<f64>, corrected: Vector2<f64>) -> f64 {
        let r2 = observed.norm_squared();
        let radial = r2 * (self.k1.abs() + r2 * (self.k2.abs() + r2 * self.k3.abs()));
        let relative = 1.0 + radial + 3.0 * self.p1.hypot(self.p2) * r2.sqrt() + self.b1.hypot(self.b2);
        8.0 * f64::EPSILON * (relative * r2.sqrt() + corrected.norm())
    }
}
