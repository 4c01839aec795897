//! Motions of a pose about a centre, and the normal equations of a registration in them.
//!
//! A motion is `[dt, ρ w]` in target axes: a translation, and a rotation vector about the centre multiplied by a radius. All
//! six are lengths, so that one eigenvalue compares with another. Whatever pairs a registration has (points, voxels, pixels
//! that fall on planes), its sums over them become one [`MotionEquations`], and there is one step.

use std::iter::Sum;

use nalgebra::{Cholesky, Isometry3, Matrix3, Matrix6, Translation3, UnitQuaternion, Vector3, Vector6};

use crate::error::Result;
use crate::motions::eigen6;
use crate::tangent::symmetrised;

/// Eigenvalues below this fraction of the largest are rounding: no step along them.
const RANK_TOLERANCE: f64 = 1e-10;
/// Share of the largest pivot above which all six motions are determined beyond doubt, so that no eigenvalues are needed:
/// far above the tolerance, since pivots are not eigenvalues (among six unknowns they differ by less than a thousand times).
const CLEAR_PIVOT: f64 = 1e-6;

/// Frame of motions `[dt, ρ w]`: rotations are about `centre` and multiplied by the radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Centred {
    /// The centre in target axes, metre; most often the mean of the pairs.
    pub centre: Vector3<f64>,
    /// The radius by which rotations are multiplied, metre, above zero; most often the rms distance from the centre.
    pub radius_m: f64,
}

impl Centred {
    /// About the mean of places (metre, most often those of pairs), with their rms distance from it, but at least `least_m`, as
    /// radius.
    #[must_use]
    pub fn about(places: impl Iterator<Item = Vector3<f64>> + Clone, least_m: f64) -> Self {
        let count = places.clone().count().max(1) as f64;
        let centre = places.clone().fold(Vector3::zeros(), |sum, place| sum + place) / count;
        let square: f64 = places.map(|place| (place - centre).norm_squared()).sum();
        Self { centre, radius_m: (square / count).sqrt().max(least_m) }
    }

    /// Derivative by the motion of the distance along `direction` (target axes) of a point at `place` (target frame, metre).
    #[inline]
    #[must_use]
    pub fn derivative(&self, place: &Vector3<f64>, direction: &Vector3<f64>) -> Vector6<f64> {
        let turn = ((place - self.centre) / self.radius_m).cross(direction);
        Vector6::new(direction.x, direction.y, direction.z, turn.x, turn.y, turn.z)
    }

    /// The pose after a finite motion.
    #[must_use]
    pub fn moved(&self, target_from_source: &Isometry3<f64>, motion: &Vector6<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(motion[3], motion[4], motion[5]) / self.radius_m);
        let dt = Vector3::new(motion[0], motion[1], motion[2]);
        let translation = self.centre + turn * (target_from_source.translation.vector - self.centre) + dt;
        let mut rotation = turn * target_from_source.rotation;
        rotation.renormalize();
        Isometry3::from_parts(Translation3::from(translation), rotation)
    }

    /// Jacobian from motions to the tangent `[dt, dθ]` of `target_from_source` (see [`step_pose`](crate::step_pose)).
    #[must_use]
    pub fn tangent_from_motion(&self, target_from_source: &Isometry3<f64>) -> Matrix6<f64> {
        let lever = target_from_source.translation.vector - self.centre;
        let r_transposed = target_from_source.rotation.to_rotation_matrix().into_inner().transpose();
        let mut jacobian = Matrix6::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        // w x lever = -[lever]x w
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-lever.cross_matrix() / self.radius_m));
        jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&(r_transposed / self.radius_m));
        jacobian
    }
}

/// Larger of the two parts of a motion.
#[must_use]
pub fn motion_length(motion: &Vector6<f64>) -> f64 {
    motion.fixed_rows::<3>(0).norm().max(motion.fixed_rows::<3>(3).norm())
}

/// Normal equations of a motion: `Σ w J Jᵀ` and `Σ w J r` over residuals r with derivatives J and weights w.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MotionEquations {
    /// `Σ w J Jᵀ`, 1/metre² where weights are over variances.
    pub matrix: Matrix6<f64>,
    /// `Σ w J r`, half the gradient of the sum of squares.
    pub gradient: Vector6<f64>,
}

impl MotionEquations {
    /// From sums of lanes: the upper triangle of the matrix row by row, and the gradient.
    #[must_use]
    pub fn from_sums(upper: &[f64; 21], gradient: &[f64; 6]) -> Self {
        Self { matrix: symmetric(upper), gradient: Vector6::from(*gradient) }
    }

    /// Adds a residual.
    #[inline]
    pub fn add(&mut self, derivative: &Vector6<f64>, weight: f64, residual: f64) {
        self.matrix.ger(weight, derivative, derivative, 1.0);
        self.gradient += derivative * (weight * residual);
    }

    /// The motion that lowers the sum of squares most, `-(H + damping · trace/6)⁻¹ g`, without a part along motions that are
    /// held or that the pairs say nothing about. `free`: projection on the motions that are not held ([`free_of`]).
    /// `damping`: share of the mean information that is added to every motion, so that what hardly matters does not run away.
    ///
    /// # Errors
    /// [`InputError::Numerical`](crate::InputError::Numerical) where the equations are not finite.
    pub fn step(&self, free: &Matrix6<f64>, damping: f64) -> Result<Vector6<f64>> {
        let matrix = symmetrised(&(free * self.matrix * free));
        let gradient = free * self.gradient;
        let mean = self.matrix.trace() / 6.0;
        let damped = matrix + (Matrix6::identity() - free) * mean + Matrix6::identity() * (damping * mean);
        if let Some(factor) = Cholesky::new(damped) {
            let pivots = factor.l_dirty().diagonal().map(|l| l * l);
            if pivots.min() > CLEAR_PIVOT * pivots.max() {
                return Ok(free * -factor.solve(&gradient));
            }
        }
        let (values, vectors) = eigen6(&matrix, "the normal equations of a step")?;
        let mut step = Vector6::zeros();
        for k in 0..6 {
            if values[k] > RANK_TOLERANCE * values[5] && values[k] > 0.0 {
                let v = vectors.column(k);
                step -= v * (v.dot(&gradient) / (values[k] + damping * mean));
            }
        }
        Ok(free * step)
    }
}

impl Sum for MotionEquations {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), |sum, part| Self {
            matrix: sum.matrix + part.matrix,
            gradient: sum.gradient + part.gradient,
        })
    }
}

/// Projection on the motions at right angles to all of `held` (orthonormal).
#[must_use]
pub fn free_of<'a>(held: impl IntoIterator<Item = &'a Vector6<f64>>) -> Matrix6<f64> {
    held.into_iter().fold(Matrix6::identity(), |free, motion| free - motion * motion.transpose())
}

/// A symmetric matrix from its upper triangle, row by row.
#[must_use]
pub fn symmetric(upper: &[f64; 21]) -> Matrix6<f64> {
    let (mut matrix, mut k) = (Matrix6::zeros(), 0);
    for r in 0..6 {
        for c in r..6 {
            (matrix[(r, c)], matrix[(c, r)]) = (upper[k], upper[k]);
            k += 1;
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::{pose_difference, step_pose};

    fn frame() -> Centred {
        Centred { centre: Vector3::new(0.3, -0.2, 2.0), radius_m: 0.7 }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let (frame, pose) = (frame(), Isometry3::new(Vector3::new(0.1, 0.4, -0.2), Vector3::new(0.3, -0.2, 0.5)));
        let (point, direction) = (nalgebra::Point3::new(0.2, 0.5, 1.5), Vector3::new(0.6, 0.0, 0.8));
        let derivative = frame.derivative(&(pose * point).coords, &direction);
        let to_tangent = frame.tangent_from_motion(&pose);
        for k in 0..6 {
            let mut motion = Vector6::zeros();
            motion[k] = 1e-6;
            let [after, before] = [motion, -motion].map(|motion| frame.moved(&pose, &motion));
            let slope = direction.dot(&(after * point - before * point)) / 2e-6;
            assert!((slope - derivative[k]).abs() < 1e-9, "{k}: {slope} {}", derivative[k]);
            let tangent = (pose_difference(&pose, &after) - pose_difference(&pose, &before)) / 2e-6;
            assert!((tangent - to_tangent.column(k)).norm() < 1e-9, "{k}");
            let stepped = step_pose(&pose, &(to_tangent * motion));
            assert!(pose_difference(&stepped, &after).norm() < 1e-11, "{k}");
        }
    }

    #[test]
    fn both_ways_to_a_step_agree_and_nothing_moves_along_what_is_held_or_open() {
        let frame = frame();
        let mut equations = MotionEquations::default();
        let mut pairs = Vec::new();
        for i in 0..60 {
            let t = f64::from(i);
            let place = frame.centre + Vector3::new((1.3 * t).sin(), (2.1 * t).cos(), (0.7 * t).sin());
            let direction = Vector3::new((0.9 * t).cos(), (1.7 * t).sin(), (0.4 * t).cos()).normalize();
            pairs.push((frame.derivative(&place, &direction), 0.01 * (3.1 * t).sin()));
        }
        for (derivative, residual) in &pairs {
            equations.add(derivative, 2.0, *residual);
        }
        let exact = -equations.matrix.try_inverse().unwrap() * equations.gradient;
        assert!((equations.step(&Matrix6::identity(), 0.0).unwrap() - exact).norm() < 1e-12);

        // One motion weaker by seven decades: the pivots no longer tell, the eigenvalues do.
        let weak = Vector6::new(0.0, 0.6, 0.0, 0.0, 0.8, 0.0);
        let mut squeezed = MotionEquations::default();
        for (derivative, residual) in &pairs {
            squeezed.add(&(derivative - weak * (derivative.dot(&weak) * (1.0 - 3e-4))), 2.0, *residual);
        }
        let exact = -squeezed.matrix.try_inverse().unwrap() * squeezed.gradient;
        let step = squeezed.step(&Matrix6::identity(), 0.0).unwrap();
        assert!((step - exact).norm() < 1e-6 * exact.norm(), "{step} {exact}");

        let held = free_of([&weak]);
        assert!(weak.dot(&equations.step(&held, 0.0).unwrap()).abs() < 1e-15);
        let mut open = MotionEquations::default();
        for (derivative, residual) in &pairs {
            open.add(&(held * derivative), 2.0, *residual);
        }
        assert!(weak.dot(&open.step(&Matrix6::identity(), 0.0).unwrap()).abs() < 1e-12);
        assert!(MotionEquations { matrix: Matrix6::from_element(f64::NAN), ..open }.step(&held, 0.0).is_err());
    }
}
