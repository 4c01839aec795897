//! Damped steps that never make the sum of squares larger.

use nalgebra::Vector6;

use super::Minimiser;
use crate::error::Result;
use crate::parts::ErrorMetric;
use crate::parts::scene::Scene;
use crate::system::System;
use rigid_pose::{free_of, require_count};

/// Damping at the first step, and the factor with which it falls and rises.
const FIRST_DAMPING: f64 = 1e-6;
const FACTOR: f64 = 10.0;
/// Damping at which a step is as good as none.
const LARGEST_DAMPING: f64 = 1e8;

/// Levenberg-Marquardt `[Marquardt1963]` to the minimum for the pairs as they are, weights included: pays where the
/// residuals are curved ([`super::super::SymmetricPlanes`] far from the solution) or matching is dear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LevenbergMarquardt {
    /// Steps for one set of pairs. Default 4.
    pub inner_iterations: usize,
}

impl Default for LevenbergMarquardt {
    fn default() -> Self {
        Self { inner_iterations: 4 }
    }
}

impl Minimiser for LevenbergMarquardt {
    fn step(&self, system: &System<'_>, held: &[Vector6<f64>]) -> Result<Vector6<f64>> {
        let (weights, free) = (system.all_weights(), free_of(held));
        let mut motion = Vector6::zeros();
        let mut squares = system.squares_after(&motion, &weights);
        let mut damping = FIRST_DAMPING;
        for _ in 0..self.inner_iterations {
            let equations = system.normal_equations_after(&motion, &weights);
            loop {
                // Motions about one centre add up to first order; the sum of squares judges the sum itself.
                let trial = motion + equations.step(&free, damping)?;
                let after = system.squares_after(&trial, &weights);
                if after <= squares {
                    let gain = squares - after;
                    (motion, squares, damping) = (trial, after, damping / FACTOR);
                    if gain <= 1e-9 * squares {
                        return Ok(motion);
                    }
                    break;
                }
                damping *= FACTOR;
                if damping > LARGEST_DAMPING {
                    return Ok(motion);
                }
            }
        }
        Ok(motion)
    }

    fn validate(&self, _: &Scene<'_>, _: &dyn ErrorMetric) -> Result<()> {
        Ok(require_count("inner_iterations", self.inner_iterations, 1)?)
    }
}
