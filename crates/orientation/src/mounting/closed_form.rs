//! Mounting from motions, in closed form `[Park1994]`.

use crate::LeverArm;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

/// Turns in which rotation and lever arm are found: each takes off what the other has got wrong, and a start needs centimetres.
const TURNS: usize = 30;

/// Motions of carrier and camera between the same two moments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    pub(crate) carrier: Isometry3<f64>,
    pub(crate) camera: Isometry3<f64>,
}

impl Motion {
    /// Between two pairs of poses (world from carrier, target from camera).
    pub(crate) fn between(first: &[Isometry3<f64>; 2], second: &[Isometry3<f64>; 2]) -> Self {
        Self { carrier: first[0].inverse() * second[0], camera: first[1].inverse() * second[1] }
    }

    /// Rotation vectors of carrier and camera, each in its own axes.
    pub(crate) fn turns(&self) -> [Vector3<f64>; 2] {
        [self.carrier, self.camera].map(|pose| pose.rotation.scaled_axis())
    }
}

/// All motions between some pairs of poses.
pub(crate) fn motions(poses: &[[Isometry3<f64>; 2]]) -> Vec<Motion> {
    let pairs = poses.iter().enumerate().flat_map(|(i, a)| poses[i + 1..].iter().map(move |b| (a, b)));
    pairs.map(|(a, b)| Motion::between(a, b)).collect()
}

/// The pose `carrier_from_camera` that makes `A X = X B` of all motions; `None` where rotations about two axes are missing.
pub(crate) fn from_rotations(motions: &[Motion]) -> Option<Isometry3<f64>> {
    let rotation = aligned(motions.iter().map(Motion::turns))?;
    let (normal, right) = lever_equations(motions, &rotation);
    let lever_arm = normal.cholesky()?.solve(&right);
    Some(Isometry3::from_parts(lever_arm.into(), rotation))
}

/// The same where something is known of the lever arm: then translations tell the rotation as well. Rotation and lever arm are
/// found in turn. `variances`: of a shift (m²) and of a turn (rad²).
pub(crate) fn with_lever_arm(motions: &[Motion], known: &LeverArm, variances: [f64; 2]) -> Option<Isometry3<f64>> {
    let [shift, turn] = variances;
    let known_normal = known.covariance.cholesky()?.inverse() * shift;
    let mut lever_arm = known.vector;
    let mut rotation = UnitQuaternion::identity();
    for _ in 0..TURNS {
        let shifts = motions.iter().map(|motion| {
            let moved = motion.carrier.translation.vector + motion.carrier.rotation * lever_arm - lever_arm;
            [moved, motion.camera.translation.vector].map(|vector| vector * (turn / shift).sqrt())
        });
        rotation = aligned(motions.iter().map(Motion::turns).chain(shifts))?;
        let (normal, right) = lever_equations(motions, &rotation);
        lever_arm = (normal + known_normal).cholesky()?.solve(&(right + known_normal * known.vector));
    }
    Some(Isometry3::from_parts(lever_arm.into(), rotation))
}

/// `(R_A − 1) t = R_X t_B − t_A` of all motions: normal matrix and right-hand side.
fn lever_equations(motions: &[Motion], rotation: &UnitQuaternion<f64>) -> (Matrix3<f64>, Vector3<f64>) {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for motion in motions {
        let row = motion.carrier.rotation.to_rotation_matrix().into_inner() - Matrix3::identity();
        normal += row.transpose() * row;
        right += row.transpose() * (rotation * motion.camera.translation.vector - motion.carrier.translation.vector);
    }
    (normal, right)
}

/// The rotation that brings each second vector onto the first best; `None` where all lie on one line.
fn aligned(pairs: impl Iterator<Item = [Vector3<f64>; 2]>) -> Option<UnitQuaternion<f64>> {
    let moments: Matrix3<f64> = pairs.map(|[a, b]| a * b.transpose()).sum();
    let svd = moments.try_svd(true, true, f64::EPSILON, 1000)?;
    let second = svd.singular_values[1];
    if second.is_nan() || second <= 1e-12 * svd.singular_values[0] {
        return None;
    }
    let (u, v_t) = (svd.u?, svd.v_t?);
    let proper = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * proper * v_t)))
}
