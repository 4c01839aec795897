//! The observation equations 4-7 of one target as the adjustment wants them.

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation, RigidPose};
use camera_model::Camera;
use nalgebra::{Point3, Vector3};

use crate::TargetObservation;

/// Image point (mm) and, where observed, range (m) of one target: blocks are the pose and, where the target's
/// coordinates are observations too, the point.
#[derive(Debug)]
pub(crate) struct TargetEquations<'a> {
    camera: &'a Camera,
    /// Coordinates where they are held.
    point: Point3<f64>,
    blocks: Vec<BlockId>,
    observed: Vector3<f64>,
    dimension: usize,
}

impl<'a> TargetEquations<'a> {
    pub(crate) fn new(camera: &'a Camera, target: &TargetObservation, pose: BlockId, point: Option<BlockId>) -> Self {
        let [x, y] = camera.format.image_from_pixel(target.pixel);
        Self {
            camera,
            point: target.point,
            blocks: std::iter::once(pose).chain(point).collect(),
            observed: Vector3::new(x, y, target.range.map_or(f64::NAN, |range| range.range_m)),
            dimension: if target.range.is_some() { 3 } else { 2 },
        }
    }
}

/// Standard deviations in the units of the equations: mm, mm and, where observed, m.
pub(crate) fn sigmas(camera: &Camera, target: &TargetObservation) -> Vec<f64> {
    let [pitch_x, pitch_y] = camera.format.pixel_pitch_mm;
    let image = [target.sigma_pixel[0] * pitch_x, target.sigma_pixel[1] * pitch_y];
    image.into_iter().chain(target.range.map(|range| range.sigma_m)).collect()
}

impl Observation for TargetEquations<'_> {
    fn dimension(&self) -> usize {
        self.dimension
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
        let pose = RigidPose::isometry(parameters[0])?;
        let point = parameters.get(1).map_or(self.point, |p| Point3::new(p[0], p[1], p[2]));
        let seen = self.camera.observe_with_jacobians(&pose, &point);
        let (seen, derivatives) = seen.map_err(|error| EvaluationFailure::new(error.to_string()))?;
        let model = Vector3::new(seen.image_mm[0], seen.image_mm[1], seen.range_m);
        for (row, residual) in residual.iter_mut().enumerate() {
            *residual = self.observed[row] - model[row];
        }
        if let Some(jacobians) = jacobians {
            jacobians.set(0, &derivatives.pose.rows(0, self.dimension));
            if self.blocks.len() > 1 {
                jacobians.set(1, &derivatives.point.rows(0, self.dimension));
            }
        }
        Ok(())
    }
}
