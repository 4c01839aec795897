//! The condition of one pair: both rays and the base lie in one plane.

use adjust::{
    Adjustment, BlockId, Covariance, Differentiated, EvaluationFailure, GroupId, ObservationId, Parameters, Real,
    ResidualFunction,
};
use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::Result;
use crate::relative::rays::Pair;

/// `e = a · (t × R b)` over its standard deviation, `[Sampson1982]`: of unit variance at the true pose, so that the
/// adjustment needs no coordinates of points. Its square is what the image points must be moved by, to first order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EpipolarCondition {
    directions: [Vector3<f64>; 2],
    covariances: [Matrix3<f64>; 2],
}

impl EpipolarCondition {
    pub(crate) fn new(pair: &Pair) -> Self {
        Self {
            directions: [pair.first.direction, pair.second.direction],
            covariances: [pair.first.covariance, pair.second.covariance],
        }
    }

    /// The condition's misfit at a pose in standard deviations; infinite where it has none.
    pub(crate) fn standardised(&self, first_from_second: &Isometry3<f64>) -> f64 {
        let [a, b] = self.directions;
        let (base, turned) = (first_from_second.translation.vector, first_from_second.rotation * b);
        let by_first = base.cross(&turned);
        let by_second = first_from_second.rotation.inverse() * a.cross(&base);
        let [first, second] = self.covariances;
        let variance = by_first.dot(&(first * by_first)) + by_second.dot(&(second * by_second));
        let standardised = -a.dot(&by_first) / variance.sqrt();
        if standardised.is_finite() { standardised } else { f64::INFINITY }
    }

    /// Adds the condition to an adjustment.
    pub(crate) fn add(self, adjustment: &mut Adjustment<'_>, group: GroupId, pose: BlockId) -> Result<ObservationId> {
        let condition = Differentiated::new(adjustment, [pose], self).map_err(adjust::Error::from)?;
        Ok(adjustment.add_observation(group, condition, &Covariance::from_sigma(1.0))?)
    }
}

impl ResidualFunction<1> for EpipolarCondition {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> std::result::Result<[T; 1], EvaluationFailure> {
        let pose = parameters.pose(0)?;
        let constant = |vector: Vector3<f64>| [vector.x, vector.y, vector.z].map(T::from);
        let [a, b] = self.directions.map(constant);
        let base = pose.translation();
        let by_first = cross(base, pose.rotate(b));
        let by_second = pose.inverse_rotate(cross(a, base));
        let variance = quadratic(&self.covariances[0], by_first) + quadratic(&self.covariances[1], by_second);
        if variance.value() <= 0.0 {
            return Err(EvaluationFailure::new("both rays lie along the base"));
        }
        Ok([-dot(a, by_first) / variance.sqrt()])
    }
}

/// The base has the length one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct UnitBase;

impl ResidualFunction<1> for UnitBase {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> std::result::Result<[T; 1], EvaluationFailure> {
        let base = parameters.pose(0)?.translation();
        Ok([-dot(base, base) + 1.0])
    }
}

fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn quadratic<T: Real>(matrix: &Matrix3<f64>, v: [T; 3]) -> T {
    let row = |i: usize| v[0] * matrix[(i, 0)] + v[1] * matrix[(i, 1)] + v[2] * matrix[(i, 2)];
    dot(v, [row(0), row(1), row(2)])
}
