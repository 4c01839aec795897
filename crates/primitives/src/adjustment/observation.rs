//! A range as an observation of a primitive.

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation};
use nalgebra::Vector3;

use crate::surface::Surface;

/// `ρ + v = ρ(primitive, ray)`: what is random lies along the ray.
pub(super) struct RangeToPrimitive {
    pub(super) blocks: [BlockId; 1],
    pub(super) surface: Surface,
    pub(super) ray: Vector3<f64>,
    pub(super) observed_m: f64,
}

impl Observation for RangeToPrimitive {
    fn dimension(&self) -> usize {
        1
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
        let values = parameters[0];
        let hit = self.surface.hit(values, &self.ray);
        let hit = hit.ok_or_else(|| EvaluationFailure::new("the ray misses the primitive"))?;
        residual[0] = self.observed_m - hit.range_m;
        if let Some(jacobians) = jacobians {
            jacobians.row(0, 0).copy_from_slice(&hit.derivatives[..values.len()]);
        }
        Ok(())
    }
}
