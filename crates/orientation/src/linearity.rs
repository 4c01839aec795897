//! Whether a covariance, which comes from a linearisation, describes the errors of a pose.

use camera_model::{Camera, Observation, step_pose};
use nalgebra::{Isometry3, Matrix6, SymmetricEigen, Vector3, Vector6};

use crate::TargetObservation;

/// Standard deviations at which the model is compared with its linearisation: where 95 % of the errors lie within.
const DEVIATIONS: f64 = 2.0;

/// Share of the observations' change that the linearisation misses two standard deviations along the weakest direction;
/// the larger of both senses, infinite where the observations do not exist there. `distance_m` makes the position
/// comparable with the attitude.
pub(crate) fn curvature(
    camera: &Camera,
    targets: &[TargetObservation],
    world_from_camera: &Isometry3<f64>,
    covariance: &Matrix6<f64>,
    distance_m: f64,
) -> f64 {
    let Some(deviation) = weakest(covariance, distance_m) else { return f64::INFINITY };
    let step = deviation * DEVIATIONS;
    [step, -step]
        .map(|step| missed(camera, targets, world_from_camera, &step).unwrap_or(f64::INFINITY) / DEVIATIONS)
        .into_iter()
        .fold(0.0, f64::max)
}

/// One standard deviation along the weakest direction.
fn weakest(covariance: &Matrix6<f64>, distance_m: f64) -> Option<Vector6<f64>> {
    let unit = Vector6::new(distance_m, distance_m, distance_m, 1.0, 1.0, 1.0);
    let scaled = Matrix6::from_fn(|row, column| covariance[(row, column)] / (unit[row] * unit[column]));
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
    let largest = eigen.eigenvalues.imax();
    Some(eigen.eigenvectors.column(largest).component_mul(&unit) * eigen.eigenvalues[largest].max(0.0).sqrt())
}

/// What the linearisation misses over a step, in standard deviations of the observations (targets' own included).
fn missed(
    camera: &Camera,
    targets: &[TargetObservation],
    world_from_camera: &Isometry3<f64>,
    step: &Vector6<f64>,
) -> Option<f64> {
    let stepped = step_pose(world_from_camera, &(*step).into());
    let mut sum = 0.0;
    for target in targets {
        let (before, derivatives) = camera.observe_with_jacobians(world_from_camera, &target.point).ok()?;
        let after = camera.observe(&stepped, &target.point).ok()?;
        let rest = vector(&after) - vector(&before) - derivatives.pose * step;
        let own = target.point_covariance.map_or(Vector3::zeros(), |covariance| {
            (derivatives.point * covariance * derivatives.point.transpose()).diagonal()
        });
        for (row, sigma) in crate::model::sigmas(camera, target).into_iter().enumerate() {
            sum += rest[row] * rest[row] / (sigma * sigma + own[row]);
        }
    }
    sum.is_finite().then(|| sum.sqrt())
}

fn vector(observation: &Observation) -> Vector3<f64> {
    Vector3::new(observation.image_mm[0], observation.image_mm[1], observation.range_m)
}
