use nalgebra::{Isometry3, Matrix3, Quaternion, Translation3, UnitQuaternion, Vector3};

use crate::{EvaluationFailure, Manifold};

/// A rigid motion `a_from_b` as a parameter block: translation and unit quaternion.
///
/// Ambient values (7): `[x, y, z, qx, qy, qz, qw]`, metre and a unit quaternion, so that
/// `p_a = rotation · p_b + (x, y, z)`.
/// Tangent step (6): `[dt, dθ]` with dt in the axes of `a` (world) and dθ, radian, in the axes of `b` (body):
/// `t ← t + dt`, `rotation ← rotation · exp(dθ)`. No attitude is singular.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RigidPose;

/// Number of stored values of a pose.
const AMBIENT: usize = 7;
/// Number of unknowns of a pose.
const TANGENT: usize = 6;

impl RigidPose {
    /// The ambient values of a pose.
    pub fn values(pose: &Isometry3<f64>) -> [f64; AMBIENT] {
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
    }

    /// The pose of ambient values, as an observation finds them among its parameters.
    ///
    /// # Errors
    /// Where there are not seven values. The quaternion is taken as it is: the adjustment keeps it at unit length.
    pub fn isometry(values: &[f64]) -> Result<Isometry3<f64>, EvaluationFailure> {
        let &[x, y, z, qx, qy, qz, qw] = values else {
            return Err(EvaluationFailure::new(format!("a rigid pose has 7 values, not {}", values.len())));
        };
        let rotation = UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz));
        Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation))
    }
}

fn rotation(values: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(values[6], values[3], values[4], values[5]))
}

impl Manifold for RigidPose {
    fn ambient_dimension(&self) -> usize {
        AMBIENT
    }

    fn tangent_dimension(&self) -> usize {
        TANGENT
    }

    fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]) {
        let turned = rotation(values) * UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
        // Normalised at each step, so that rounding never accumulates.
        let turned = turned.quaternion().normalize();
        for axis in 0..3 {
            out[axis] = values[axis] + step[axis];
            out[3 + axis] = turned.coords[axis];
        }
        out[6] = turned.w;
    }

    fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        let turn = (rotation(reference).inverse() * rotation(values)).scaled_axis();
        for axis in 0..3 {
            out[axis] = values[axis] - reference[axis];
            out[3 + axis] = turn[axis];
        }
    }

    fn minus_jacobian(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
        let mut difference = [0.0; TANGENT];
        self.minus(values, reference, &mut difference);
        let inverse = right_jacobian_inverse(&Vector3::new(difference[3], difference[4], difference[5]));
        out.fill(0.0);
        for row in 0..3 {
            out[row * TANGENT + row] = 1.0;
            for column in 0..3 {
                out[(row + 3) * TANGENT + column + 3] = inverse[(row, column)];
            }
        }
    }

    fn check(&self, values: &[f64]) -> Result<(), &'static str> {
        let norm = values[3..].iter().map(|q| q * q).sum::<f64>().sqrt();
        // Files keep about seven digits; anything further off is another parameterisation.
        if (norm - 1.0).abs() < 1e-6 { Ok(()) } else { Err("the quaternion (values 3 to 6) is not of unit length") }
    }

    fn tangent_name(&self, component: usize) -> Option<&str> {
        ["tx", "ty", "tz", "rx", "ry", "rz"].get(component).copied()
    }
}

/// Inverse right Jacobian of the rotation vector θ: `log(exp(θ) exp(δ)) = θ + J⁻¹ δ`.
fn right_jacobian_inverse(theta: &Vector3<f64>) -> Matrix3<f64> {
    let angle = theta.norm();
    let skew = theta.cross_matrix();
    // 1/12 is the limit at zero; below 1e-3 rad the next term, θ²/720, leaves nothing that double precision sees.
    let second = if angle < 1e-3 {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle)
    };
    Matrix3::identity() + skew * 0.5 + skew * skew * second
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// The same manifold with the trait's own differences.
    #[derive(Debug)]
    struct ByDifferences;

    impl Manifold for ByDifferences {
        fn ambient_dimension(&self) -> usize {
            AMBIENT
        }
        fn tangent_dimension(&self) -> usize {
            TANGENT
        }
        fn plus(&self, values: &[f64], step: &[f64], out: &mut [f64]) {
            RigidPose.plus(values, step, out);
        }
        fn minus(&self, values: &[f64], reference: &[f64], out: &mut [f64]) {
            RigidPose.minus(values, reference, out);
        }
    }

    fn pose(turn: [f64; 3]) -> [f64; 7] {
        RigidPose::values(&Isometry3::new(Vector3::new(1.0, -2.0, 0.5), Vector3::from(turn)))
    }

    #[test]
    fn minus_undoes_plus() {
        for turn in [[0.0; 3], [1e-9, 0.0, 0.0], [0.3, -0.2, 0.1], [2.0, 1.0, -2.0]] {
            for step in [[0.1, 0.2, -0.3, 0.01, -0.02, 0.03], [5.0, 0.0, 0.0, 1.5, -2.0, 1.0]] {
                let (mut moved, mut back) = ([0.0; 7], [0.0; 6]);
                RigidPose.plus(&pose(turn), &step, &mut moved);
                RigidPose.minus(&moved, &pose(turn), &mut back);
                for (a, b) in step.iter().zip(back) {
                    assert_relative_eq!(*a, b, epsilon = 1e-12);
                }
                assert_eq!(RigidPose.check(&moved), Ok(()));
            }
        }
    }

    #[test]
    fn jacobian_of_minus_agrees_with_differences() {
        // From no rotation through the change of formula (1e-3 rad) to 3 rad.
        for angle in [0.0, 1e-6, 0.999e-3, 1.001e-3, 0.1, 1.0, 3.0] {
            let values = pose([0.6 * angle, -0.64 * angle, 0.48 * angle]);
            let (mut analytic, mut numeric) = ([0.0; 36], [0.0; 36]);
            RigidPose.minus_jacobian(&values, &pose([0.0; 3]), &mut analytic);
            ByDifferences.minus_jacobian(&values, &pose([0.0; 3]), &mut numeric);
            for (a, n) in analytic.iter().zip(numeric) {
                // Central differences with steps of 6e-6.
                assert_relative_eq!(*a, n, epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn the_step_is_in_world_axes_for_position_and_body_axes_for_rotation() {
        let start = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
        let mut moved = [0.0; 7];
        RigidPose.plus(&RigidPose::values(&start), &[1.0, 0.0, 0.0, 0.1, 0.0, 0.0], &mut moved);
        let Ok(moved) = RigidPose::isometry(&moved) else { unreachable!("seven values") };
        assert_relative_eq!(moved.translation.vector, Vector3::new(2.0, 2.0, 3.0), epsilon = 1e-15);
        // A turn about the body's x axis, which lies along the world's y.
        let turn = (moved.rotation * start.rotation.inverse()).scaled_axis();
        assert_relative_eq!(turn, Vector3::new(0.0, 0.1, 0.0), epsilon = 1e-15);
        assert!(RigidPose::isometry(&[0.0; 3]).is_err());
    }
}
