//! Start values: mounting from rotations, velocities from positions, gravity from what is left.

use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::preintegrated::Preintegrated;
use crate::sequence::options::{CameraPose, Mounting, SequenceOptions};

/// Standard deviations beyond which a turn contradicts: no noise comes near, and wrong units and axes go far beyond.
const FAR: f64 = 10.0;

/// Start values.
pub(crate) struct Start {
    pub(crate) camera_from_body: Isometry3<f64>,
    pub(crate) velocities: Vec<Vector3<f64>>,
    pub(crate) gravity: Vector3<f64>,
}

impl Start {
    pub(crate) fn new(poses: &[CameraPose], motions: &[Preintegrated], options: &SequenceOptions) -> Self {
        let camera_from_body = match options.mounting {
            Mounting::Known(pose) => pose,
            Mounting::UnknownRotation { lever_arm } => Isometry3::from_parts(lever_arm.into(), aligned(poses, motions)),
        };
        let bodies: Vec<Isometry3<f64>> = poses.iter().map(|pose| pose.pose.pose * camera_from_body).collect();
        let velocities = velocities(poses, &bodies);
        let accelerations = motions.iter().enumerate().map(|(k, motion)| {
            (velocities[k + 1] - velocities[k] - bodies[k].rotation * motion.velocity) / motion.seconds
        });
        let mean: Vector3<f64> = accelerations.sum::<Vector3<f64>>() / motions.len() as f64;
        let gravity = mean.try_normalize(f64::MIN_POSITIVE).unwrap_or(-Vector3::z()) * options.gravity_m_s2;
        Self { camera_from_body, velocities, gravity }
    }
}

/// Means of the velocities before and after each pose.
fn velocities(poses: &[CameraPose], bodies: &[Isometry3<f64>]) -> Vec<Vector3<f64>> {
    let between = |k: usize| {
        let way = bodies[k + 1].translation.vector - bodies[k].translation.vector;
        way / (poses[k + 1].time_s - poses[k].time_s)
    };
    let last = bodies.len() - 1;
    (0..=last)
        .map(|k| match k {
            0 => between(0),
            k if k == last => between(k - 1),
            k => (between(k - 1) + between(k)) * 0.5,
        })
        .collect()
}

/// The rotation that brings the unit's rotation vectors onto the camera's best.
fn aligned(poses: &[CameraPose], motions: &[Preintegrated]) -> UnitQuaternion<f64> {
    let turns = motions.iter().zip(poses.windows(2)).map(|(motion, pair)| {
        let camera = (pair[0].pose.pose.rotation.inverse() * pair[1].pose.pose.rotation).scaled_axis();
        camera * motion.rotation.scaled_axis().transpose()
    });
    let moments: Matrix3<f64> = turns.sum();
    let Some((u, v_t)) = moments.try_svd(true, true, f64::EPSILON, 1000).and_then(|svd| svd.u.zip(svd.v_t)) else {
        return UnitQuaternion::identity();
    };
    let proper = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * proper * v_t))
}

/// Median ratio of the angles by which unit (as it measures) and camera turn; NaN where the camera does not.
pub(crate) fn angle_ratio(poses: &[CameraPose], motions: &[Preintegrated]) -> f64 {
    let ratio = |(motion, pair): (&Preintegrated, &[CameraPose])| {
        motion.measured_angle() / pair[0].pose.pose.rotation.angle_to(&pair[1].pose.pose.rotation)
    };
    let mut ratios: Vec<f64> =
        motions.iter().zip(poses.windows(2)).map(ratio).filter(|ratio| ratio.is_finite()).collect();
    statistics::upper_median(&mut ratios)
}

/// Intervals in which unit and camera turn differently by far more than their noise, a common bias of the rates taken off.
pub(crate) fn contradicting_turns(
    poses: &[CameraPose],
    motions: &[Preintegrated],
    camera_from_body: &Isometry3<f64>,
) -> usize {
    let turned = |(motion, pair): (&Preintegrated, &[CameraPose])| {
        let body = |k: usize| pair[k].pose.pose.rotation * camera_from_body.rotation;
        let turn = (motion.rotation.inverse() * body(0).inverse() * body(1)).scaled_axis();
        let of = |k: usize| pair[k].pose.covariance.fixed_view::<3, 3>(3, 3).trace();
        let variance = of(0) + of(1) + motion.covariance.fixed_view::<3, 3>(0, 0).trace();
        (turn / motion.seconds, variance.sqrt() / motion.seconds)
    };
    let rates: Vec<(Vector3<f64>, f64)> = motions.iter().zip(poses.windows(2)).map(turned).collect();
    let middle =
        |axis: usize| statistics::upper_median(&mut rates.iter().map(|(rate, _)| rate[axis]).collect::<Vec<f64>>());
    let bias = Vector3::new(middle(0), middle(1), middle(2));
    rates.iter().filter(|(rate, sigma)| (rate - bias).norm() > FAR * sigma).count()
}
