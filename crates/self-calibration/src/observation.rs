//! A range difference as an observation of the adjustment.

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation};
use error_models::AmplitudeHyperbola;

/// `ρ_observed − ρ_reference = Δρ(ρ_observed, x, y, a)`: linear in the terms of the first block, not in the
/// hyperbola of the second, where there is one.
///
/// The correction is a function of the observed range, as it will be when it is applied. The noise in that argument
/// changes it by `∂Δρ/∂ρ · σ`, a few hundredths of the noise itself.
pub(crate) struct DifferenceObservation<'a> {
    pub(crate) blocks: Vec<BlockId>,
    /// Observed minus reference range, metre.
    pub(crate) difference_m: f64,
    pub(crate) amplitude: f64,
    /// Design row of the terms.
    pub(crate) row: &'a [f64],
    pub(crate) amplitude_span: [f64; 2],
}

impl DifferenceObservation<'_> {
    fn hyperbola(&self, coefficients: &[f64]) -> Result<AmplitudeHyperbola, EvaluationFailure> {
        let [h1, h2, h3] = *coefficients else {
            return Err(EvaluationFailure::new("the hyperbola has three coefficients"));
        };
        Ok(AmplitudeHyperbola { h1, h2, h3, amplitude_span: self.amplitude_span })
    }
}

impl Observation for DifferenceObservation<'_> {
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
        let linear: f64 = self.row.iter().zip(parameters[0]).map(|(derivative, term)| derivative * term).sum();
        residual[0] = self.difference_m - linear;
        let hyperbola = parameters.get(1).map(|coefficients| self.hyperbola(coefficients)).transpose()?;
        if let Some(hyperbola) = hyperbola {
            let amplitude_m = hyperbola.correction(self.amplitude);
            residual[0] -= amplitude_m.ok_or_else(|| EvaluationFailure::new("the radicand of Eq. 15 is negative"))?;
        }
        let Some(jacobians) = jacobians else { return Ok(()) };
        jacobians.row(0, 0).copy_from_slice(self.row);
        if let Some(hyperbola) = hyperbola {
            let jacobian = hyperbola.jacobian(self.amplitude);
            let jacobian = jacobian.ok_or_else(|| EvaluationFailure::new("the slope of Eq. 15 is infinite"))?;
            jacobians.row(1, 0).copy_from_slice(&jacobian.coefficients);
        }
        Ok(())
    }
}
