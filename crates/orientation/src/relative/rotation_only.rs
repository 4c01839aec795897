//! Whether the views differ by a rotation alone: then there is no base to be found.

use adjust::{
    Adjustment, Covariance, Differentiated, EvaluationFailure, ParameterBlock, Parameters, Real, ResidualFunction,
    SolveOptions,
};
use nalgebra::{Isometry3, Matrix2, Matrix2x3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::Result;
use crate::relative::rays::Pair;

/// Components of the turned second ray across the first.
struct Turned {
    across: Matrix2x3<f64>,
    second: Vector3<f64>,
}

impl ResidualFunction<2> for Turned {
    fn residual<T: Real>(&self, parameters: &Parameters<'_, T>) -> std::result::Result<[T; 2], EvaluationFailure> {
        let [x, y, z] = parameters.pose(0)?.rotate([self.second.x, self.second.y, self.second.z].map(T::from));
        let row = |i: usize| -(x * self.across[(i, 0)] + y * self.across[(i, 1)] + z * self.across[(i, 2)]);
        Ok([row(0), row(1)])
    }
}

/// `vᵀPv` of the rotation that brings the second rays onto the first best, without a base.
pub(crate) fn rotation_only(pairs: &[Pair], options: &SolveOptions) -> Result<f64> {
    let start = Isometry3::from_parts(Vector3::zeros().into(), start(pairs));
    let mut adjustment = Adjustment::new();
    let pose = adjustment.add_block(ParameterBlock::pose(&start).named("rotation"));
    for component in 0..3 {
        adjustment.hold_parameter(pose, component)?;
    }
    let group = adjustment.add_group("directions");
    for pair in pairs {
        let across = across(&pair.first.direction);
        let turned = start.rotation.to_rotation_matrix().into_inner();
        let scatter: Matrix3<f64> = pair.first.covariance + turned * pair.second.covariance * turned.transpose();
        let covariance: Matrix2<f64> = across * scatter * across.transpose();
        let condition = Turned { across, second: pair.second.direction };
        let condition = Differentiated::new(&adjustment, [pose], condition).map_err(adjust::Error::from)?;
        adjustment.add_observation(
            group,
            condition,
            &Covariance::from_matrix(&((covariance + covariance.transpose()) * 0.5)),
        )?;
    }
    Ok(adjustment.solve(options)?.vtpv())
}

/// The rotation with the largest `Σ a · R b` `[Wahba1965]`.
fn start(pairs: &[Pair]) -> UnitQuaternion<f64> {
    let moments: Matrix3<f64> = pairs.iter().map(|pair| pair.first.direction * pair.second.direction.transpose()).sum();
    let Some((u, v_t)) = moments.try_svd(true, true, f64::EPSILON, 1000).and_then(|svd| svd.u.zip(svd.v_t)) else {
        return UnitQuaternion::identity();
    };
    let proper = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * proper * v_t))
}

/// Two unit vectors across a direction, and across each other.
pub(crate) fn across(direction: &Vector3<f64>) -> Matrix2x3<f64> {
    let axis = direction.iamin();
    let one = direction.cross(&Vector3::from_fn(|k, _| f64::from(u8::from(k == axis)))).normalize();
    Matrix2x3::from_rows(&[one.transpose(), direction.cross(&one).transpose()])
}
