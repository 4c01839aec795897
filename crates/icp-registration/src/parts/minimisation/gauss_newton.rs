//! Gauss-Newton on the manifold of poses.

use nalgebra::Vector6;

use super::Minimiser;
use crate::error::Result;
use crate::system::System;
use rigid_pose::free_of;

/// One solution of the 6x6 normal equations, with weights as they are: no step along motions without information.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct GaussNewton;

impl Minimiser for GaussNewton {
    fn step(&self, system: &System<'_>, held: &[Vector6<f64>]) -> Result<Vector6<f64>> {
        Ok(system.normal_equations().step(&free_of(held), 0.0)?)
    }
}
