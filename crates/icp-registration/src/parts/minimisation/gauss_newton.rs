//! Gauss-Newton on the manifold of poses.

use nalgebra::{Matrix6, Vector6};

use super::Minimiser;
use crate::error::Result;
use crate::system::System;
use rigid_pose::eigen6;
use rigid_pose::symmetrised;

/// Eigenvalues below this fraction of the largest are rounding: no step along them.
const RANK_TOLERANCE: f64 = 1e-10;

/// One solution of the 6x6 normal equations, with weights as they are: no step along motions without information.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GaussNewton;

impl Minimiser for GaussNewton {
    fn step(&self, system: &System<'_>, held: &[Vector6<f64>]) -> Result<Vector6<f64>> {
        let (h, g) = system.normal_equations();
        complement_step(&h, &g, held, 0.0)
    }
}

/// `−(H + damping · trace/6)⁻¹ g` in the complement of the held directions (orthonormal).
pub(crate) fn complement_step(
    h: &Matrix6<f64>,
    g: &Vector6<f64>,
    held: &[Vector6<f64>],
    damping: f64,
) -> Result<Vector6<f64>> {
    let mut keep = Matrix6::identity();
    for direction in held {
        keep -= direction * direction.transpose();
    }
    let (values, vectors) = eigen6(&symmetrised(&(keep * h * keep)), "the normal equations of an iteration")?;
    let right = keep * g;
    let damped = damping * h.trace() / 6.0;
    let mut step = Vector6::zeros();
    for k in 0..6 {
        if values[k] > RANK_TOLERANCE * values[5] && values[k] > 0.0 {
            let v = vectors.column(k);
            step -= v * (v.dot(&right) / (values[k] + damped));
        }
    }
    Ok(keep * step)
}
