//! Motions that nothing determines.

use nalgebra::{Isometry3, Matrix6, Point3, Vector3, Vector6};

use icp_registration::{MotionKind, UndeterminedMotion};
use rigid_pose::eigen6;
use rigid_pose::{pose_difference, step_pose, symmetrised};

/// The motions of a station that are known no better than the size of a patch, from the covariance of its pose:
/// farther off, the surfaces that it meets would be others. Rotations count at `hold_m`.
pub(crate) fn undetermined(
    pose: &Isometry3<f64>,
    covariance: &Matrix6<f64>,
    hold_m: f64,
    size_m: f64,
) -> Vec<UndeterminedMotion> {
    let open = open(&to_world(pose, hold_m), covariance, size_m);
    open.into_iter().map(|(motion, sigma_m)| named(pose, &motion, sigma_m, hold_m)).collect()
}

/// The pose with what is undetermined of it as it was at the start; `None` where all is determined.
pub(crate) fn returned(
    pose: &Isometry3<f64>,
    start: &Isometry3<f64>,
    covariance: &Matrix6<f64>,
    hold_m: f64,
    size_m: f64,
) -> Option<Isometry3<f64>> {
    let to_world = to_world(pose, hold_m);
    let open = open(&to_world, covariance, size_m);
    let back = to_world * pose_difference(pose, start);
    let step = open.iter().fold(Vector6::zeros(), |step, (motion, _)| step + motion * motion.dot(&back));
    let step = to_world.try_inverse()? * step;
    (!open.is_empty()).then(|| step_pose(pose, &step))
}

/// From the tangent of a pose to motions about world axes, rotations as lengths at the radius at which they are held.
fn to_world(pose: &Isometry3<f64>, hold_m: f64) -> Matrix6<f64> {
    let mut to_world = Matrix6::identity();
    to_world.fixed_view_mut::<3, 3>(3, 3).copy_from(&(pose.rotation.to_rotation_matrix().into_inner() * hold_m));
    to_world
}

/// Motions with a standard deviation beyond a length, and that deviation.
fn open(to_world: &Matrix6<f64>, covariance: &Matrix6<f64>, size_m: f64) -> Vec<(Vector6<f64>, f64)> {
    let covariance = symmetrised(&(to_world * covariance * to_world.transpose()));
    let Ok((values, vectors)) = eigen6(&covariance, "a covariance") else { return Vec::new() };
    let open = (0..6).filter(|&k| values[k] > size_m * size_m);
    open.map(|k| (vectors.column(k).into_owned(), values[k].sqrt())).collect()
}

fn named(pose: &Isometry3<f64>, motion: &Vector6<f64>, sigma_m: f64, hold_m: f64) -> UndeterminedMotion {
    let (slide, turn) = (Vector3::new(motion[0], motion[1], motion[2]), Vector3::new(motion[3], motion[4], motion[5]));
    if turn.norm() < slide.norm() {
        let through = Point3::from(pose.translation.vector);
        return UndeterminedMotion { kind: MotionKind::Translation, axis: slide / slide.norm(), through, sigma_m };
    }
    let w = turn / hold_m;
    let through = Point3::from(pose.translation.vector + w.cross(&slide) / w.norm_squared());
    UndeterminedMotion { kind: MotionKind::Rotation, axis: turn / turn.norm(), through, sigma_m }
}
