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
