use std::sync::Arc;

use crate::{BlockId, EvaluationFailure, Jacobians, Manifold, Observation};

/// A weighted parameter block: the difference to its prior values, in the tangent space at the prior, is observed as
/// zero.
#[derive(Debug)]
pub struct PriorObservation {
    block: [BlockId; 1],
    manifold: Arc<dyn Manifold>,
    prior: Vec<f64>,
}

impl PriorObservation {
    /// The prior values (ambient) of a block on a manifold.
    pub fn new(block: BlockId, manifold: Arc<dyn Manifold>, prior: Vec<f64>) -> Self {
        Self { block: [block], manifold, prior }
    }
}

impl Observation for PriorObservation {
    fn dimension(&self) -> usize {
        self.manifold.tangent_dimension()
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
        self.manifold.minus(parameters[0], &self.prior, residual);
        for value in residual.iter_mut() {
            *value = -*value;
        }
        if let Some(jacobians) = jacobians {
            // One block: its rows follow each other without a gap.
            self.manifold.minus_jacobian(parameters[0], &self.prior, jacobians.data);
        }
        Ok(())
    }
}
