//! Poses that hang on the shared error of the sensor.

use nalgebra::{Isometry3, Matrix6};

use projective_registration::{ByField, Field, FieldMatrix};
use rigid_pose::{Uncertain, inverse_jacobian, product_jacobians};
use rigid_pose::{step_pose, symmetrised};

/// A pose `a_from_b` for the field that is assumed for the sensor's shared error: with the covariance of what is random
/// beside it, and its derivative by the coefficients of the field.
#[derive(Debug, Clone, Copy)]
pub struct Relation {
    /// The pose with its random errors.
    pub random: Uncertain,
    /// Its derivative by the coefficients of the shared error, tangent `[dt, dtheta]`.
    pub by_field: ByField,
}

impl Relation {
    /// A pose without errors.
    pub fn exact(pose: Isometry3<f64>) -> Self {
        Self { random: Uncertain::exact(pose), by_field: ByField::zeros() }
    }

    /// The pose.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.random.pose
    }

    /// The pose the other way around.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let by_field = inverse_jacobian(&self.random.pose) * self.by_field;
        Self { random: self.random.inverse(), by_field }
    }

    /// `a_from_c` from this `a_from_b` and `b_from_c` of independent random errors.
    #[must_use]
    pub fn then(&self, b_from_c: &Self) -> Self {
        let (by_first, by_second) = product_jacobians(self.pose(), b_from_c.pose());
        let by_field = by_first * self.by_field + by_second * b_from_c.by_field;
        Self { random: self.random.then(&b_from_c.random), by_field }
    }

    /// The same for a field that is `change` more.
    pub(crate) fn moved(&self, change: &Field) -> Self {
        let pose = step_pose(self.pose(), &(self.by_field * change));
        Self { random: Uncertain { pose, ..self.random }, ..*self }
    }

    /// The mean of two observations of one pose with independent random errors; `None` where a covariance is none.
    pub(crate) fn mean(&self, other: &Self) -> Option<Self> {
        let random = self.random.combined(&other.random)?;
        let weighted = |one: &Self| Some(random.covariance * one.random.covariance.cholesky()?.solve(&one.by_field));
        Some(Self { random, by_field: weighted(self)? + weighted(other)? })
    }

    /// With the covariance of all errors; `field`: that of the coefficients.
    pub fn total(&self, field: &FieldMatrix) -> Uncertain {
        let shared: Matrix6<f64> = self.by_field * field * self.by_field.transpose();
        Uncertain { covariance: symmetrised(&(self.random.covariance + shared)), ..self.random }
    }
}
