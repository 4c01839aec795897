use nalgebra::Isometry3;

use crate::descent::iteration::{Ending, Iteration};
use crate::linearised::layout::Layout;
use crate::{Adjustment, BlockId, Error, Method, Result, RigidPose, SolveOptions, TraceEntry};

/// Parameters on the way to the solution: better than the approximate values, and not adjusted.
///
/// The descent was broken off, so that nothing can be said about how well they are known: there are no covariances here.
/// [`Adjustment::solve`] gives them.
#[derive(Debug, Clone)]
pub struct Descent {
    layout: Layout,
    values: Vec<f64>,
    objective: f64,
    trace: Vec<TraceEntry>,
}

impl Adjustment<'_> {
    /// Descends until a step reduces the objective by no more than the share `objective_tolerance` (1e-6 is usual), and
    /// gives the values found there: start values for [`Self::solve`], or all that is wanted where only the fit counts.
    /// A rank defect does no harm to damped steps, so that a network needs no datum.
    ///
    /// # Errors
    /// [`Error::Option`] where the tolerance is not positive or the method is [`Method::GaussNewton`], which does not
    /// descend; [`Error::NotConverged`], [`Error::Evaluation`] and [`Error::NotFinite`] as for [`Self::solve`].
    pub fn descend(&self, options: &SolveOptions, objective_tolerance: f64) -> Result<Descent> {
        options.check()?;
        if !(objective_tolerance.is_finite() && objective_tolerance > 0.0) {
            let expected = "a positive number";
            return Err(Error::Option { name: "objective_tolerance", value: objective_tolerance, expected });
        }
        if options.method == Method::GaussNewton {
            let expected = "a method that descends: Levenberg-Marquardt";
            return Err(Error::Option { name: "objective_tolerance", value: objective_tolerance, expected });
        }
        let layout = Layout::new(self)?;
        let mut iteration = Iteration::new(self, &layout, options)?;
        if layout.unknowns > 0
            && !iteration.descend_damped(&Ending { gain: 0.0, decrease: objective_tolerance, damping: 0.0 })?
        {
            return Err(iteration.not_converged("no step reduces the objective"));
        }
        let (values, objective, trace) = (iteration.values, iteration.current.objective, iteration.trace);
        Ok(Descent { layout, values, objective, trace })
    }
}

impl Descent {
    /// Values of a block, ambient.
    pub fn values(&self, block: BlockId) -> Result<&[f64]> {
        let count = self.layout.blocks();
        if block.index() >= count {
            return Err(Error::UnknownId { what: "block", index: block.index(), count });
        }
        Ok(&self.values[self.layout.block_values(block.index())])
    }

    /// Pose of a [`RigidPose`] block.
    pub fn pose(&self, block: BlockId) -> Result<Isometry3<f64>> {
        let values = self.values(block)?;
        let what = format!("block {}, taken as a pose,", block.index());
        RigidPose::isometry(values).map_err(|_| Error::Length { what, expected: 7, found: values.len() })
    }

    /// vᵀPv, or the sum of ρ where kernels are robust.
    pub fn objective(&self) -> f64 {
        self.objective
    }

    /// Iterations taken.
    pub fn iterations(&self) -> usize {
        self.trace.len()
    }

    /// What each iteration did.
    pub fn trace(&self) -> &[TraceEntry] {
        &self.trace
    }
}
