//! The observation equations of an interval.

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation, RigidPose};
use nalgebra::{Isometry3, Vector3, Vector6};
use rigid_pose::product_jacobians;

use crate::noise::Biases;
use crate::preintegrated::Preintegrated;
use crate::residual::NavigationState;

/// Preintegrated motion between two camera poses. Blocks: pose, velocity and biases at the start, pose and velocity at the
/// end, gravity, `camera_from_body`.
#[derive(Debug)]
pub(crate) struct IntervalEquations<'p> {
    pub(crate) motion: &'p Preintegrated,
    pub(crate) blocks: [BlockId; 7],
}

impl Observation for IntervalEquations<'_> {
    fn dimension(&self) -> usize {
        9
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let camera_from_body = RigidPose::isometry(parameters[6])?;
        let cameras: [Isometry3<f64>; 2] = [RigidPose::isometry(parameters[0])?, RigidPose::isometry(parameters[3])?];
        let state = |camera: &Isometry3<f64>, velocity: &[f64]| NavigationState {
            world_from_body: camera * camera_from_body,
            velocity: Vector3::from_column_slice(velocity),
        };
        let (start, end) = (state(&cameras[0], parameters[1]), state(&cameras[1], parameters[4]));
        let biases = Biases::from_vector(&Vector6::from_column_slice(parameters[2]));
        let gravity = Vector3::from_column_slice(parameters[5]);
        let (value, by) = self.motion.residual_with_jacobians(&start, &end, &gravity, &biases);
        // States minus motion are model minus observed.
        residual.copy_from_slice((-value).as_slice());
        if let Some(jacobians) = jacobians {
            let [(start_camera, start_mounting), (end_camera, end_mounting)] =
                [0, 1].map(|k| product_jacobians(&cameras[k], &camera_from_body));
            jacobians.set(0, &(by.start_pose * start_camera));
            jacobians.set(1, &by.start_velocity);
            jacobians.set(2, &by.biases);
            jacobians.set(3, &(by.end_pose * end_camera));
            jacobians.set(4, &by.end_velocity);
            jacobians.set(5, &by.gravity);
            jacobians.set(6, &(by.start_pose * start_mounting + by.end_pose * end_mounting));
        }
        Ok(())
    }
}

/// Two blocks of one dimension differ by nothing.
#[derive(Debug)]
pub(crate) struct Unchanged {
    pub(crate) blocks: [BlockId; 2],
}

impl Observation for Unchanged {
    fn dimension(&self) -> usize {
        6
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        for ((out, before), after) in residual.iter_mut().zip(parameters[0]).zip(parameters[1]) {
            *out = before - after;
        }
        if let Some(jacobians) = jacobians {
            let one = nalgebra::Matrix6::identity();
            jacobians.set(0, &-one);
            jacobians.set(1, &one);
        }
        Ok(())
    }
}

/// The length of a vector.
#[derive(Debug)]
pub(crate) struct Length {
    pub(crate) observed: f64,
    pub(crate) block: [BlockId; 1],
}

impl Observation for Length {
    fn dimension(&self) -> usize {
        1
    }

    fn blocks(&self) -> &[BlockId] {
        &self.block
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> Result<(), EvaluationFailure> {
        let vector = Vector3::from_column_slice(parameters[0]);
        residual[0] = self.observed - vector.norm();
        let direction = vector.try_normalize(f64::MIN_POSITIVE);
        let direction = direction.ok_or_else(|| EvaluationFailure::new("gravity has no direction"))?;
        if let Some(jacobians) = jacobians {
            jacobians.set(0, &direction.transpose());
        }
        Ok(())
    }
}
