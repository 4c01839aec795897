//! The rational distortion model of `OpenCV` and ROS (`rational_polynomial`), as the factory calibrations of time-of-flight
//! cameras state it, and the way to ours.

use nalgebra::{Matrix2, Vector2};

use crate::lenses::plumb_bob::{PlumbBob, fit_camera, pinhole};
use crate::{Camera, Error, Result};

/// Newton steps to the ideal point of a distorted one; well inside the fold five are taken.
const MAX_STEPS: usize = 50;

/// Points looked at between the principal point and the ideal one: beyond a fold the same image comes again.
const SAMPLES_TO_FOLD: usize = 64;

/// Camera matrix and coefficients of the rational model, in pixels and computer-vision axes as [`PlumbBob`]: the radial factor is
/// `(1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rational {
    /// Camera matrix, size, k1, k2, p1, p2, k3.
    pub numerator: PlumbBob,
    /// k4, k5, k6.
    pub denominator: [f64; 3],
}

impl Rational {
    /// The distorted point of an ideal one, both normalised with y down, and the derivative.
    fn distorted(&self, ideal: Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let PlumbBob { k1, k2, k3, p1, p2, .. } = self.numerator;
        let [k4, k5, k6] = self.denominator;
        let (x, y, r2) = (ideal.x, ideal.y, ideal.norm_squared());
        let above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        let factor = above / below;
        let above_slope = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
        let below_slope = k4 + r2 * (2.0 * k5 + r2 * 3.0 * k6);
        // Derivative of the factor by r².
        let slope = (above_slope - factor * below_slope) / below;
        let decentred =
            Vector2::new(2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
        let of_decentring = Matrix2::new(
            2.0 * p1 * y + 6.0 * p2 * x,
            2.0 * p1 * x + 2.0 * p2 * y,
            2.0 * p1 * x + 2.0 * p2 * y,
            6.0 * p1 * y + 2.0 * p2 * x,
        );
        let of_radius = 2.0 * slope * ideal * ideal.transpose();
        (ideal * factor + decentred, Matrix2::identity() * factor + of_radius + of_decentring)
    }

    /// The ideal point (normalised, y down) that the model shows at a pixel; fails beyond its fold.
    fn ideal(&self, [col, row]: [f64; 2]) -> Result<Vector2<f64>> {
        let PlumbBob { fx, fy, cx, cy, .. } = self.numerator;
        let seen = Vector2::new((col - cx) / fx, (row - cy) / fy);
        let fold = || Error::RationalFold { col, row };
        let mut ideal = seen;
        for _ in 0..MAX_STEPS {
            let (distorted, derivative) = self.distorted(ideal);
            let step = derivative.try_inverse().ok_or_else(fold)? * (seen - distorted);
            ideal += step;
            if step.norm() <= 16.0 * f64::EPSILON * (1.0 + ideal.norm()) {
                return if self.one_to_one_to(ideal) { Ok(ideal) } else { Err(fold()) };
            }
        }
        Err(fold())
    }

    /// Whether the derivative keeps its sign from the principal point to an ideal one.
    fn one_to_one_to(&self, ideal: Vector2<f64>) -> bool {
        (1..=SAMPLES_TO_FOLD).all(|i| {
            let (_, derivative) = self.distorted(ideal * (i as f64 / SAMPLES_TO_FOLD as f64));
            derivative.determinant() > 0.0 && derivative.trace() > 0.0
        })
    }
}

impl Camera {
    /// The camera whose rays agree best, over the image, with those of a rational model, and the largest residual in pixels; as
    /// [`Camera::from_plumb_bob`]. Our lens has three radial terms, the rational model six: of a wide field of view, a pixel may
    /// be left in the corners.
    ///
    /// Fails with [`Error::RationalFold`] where the given model folds over inside its image.
    pub fn from_rational(model: &Rational, pixel_pitch_mm: f64) -> Result<(Self, f64)> {
        let names = ["k4", "k5", "k6"];
        if let Some((name, &value)) = names.into_iter().zip(&model.denominator).find(|(_, value)| !value.is_finite()) {
            return Err(Error::OutOfDomain { name, value, expected: "a lens coefficient is finite" });
        }
        let up = Matrix2::new(1.0, 0.0, 0.0, -1.0);
        let ideal = |pixel| Ok(up * model.ideal(pixel)?);
        let derivative = |ideal: Vector2<f64>| up * model.distorted(up * ideal).1 * up;
        fit_camera(pinhole(&model.numerator, pixel_pitch_mm)?, ideal, derivative)
    }
}
