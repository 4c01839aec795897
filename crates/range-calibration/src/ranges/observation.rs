//! A range difference as an observation of the adjustment.

use adjust::{BlockId, EvaluationFailure, Jacobians, Observation};
use error_models::AmplitudeHyperbola;

use crate::ranges::hyperbola_real::RealHyperbola;

/// What the three numbers of the hyperbola's block are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum HyperbolaForm {
    /// h1, h2, h3, over a span of amplitudes.
    Coefficients([f64; 2]),
    /// The logarithms of [`RealHyperbola`], from this amplitude on.
    Real(f64),
}

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
    pub(crate) form: HyperbolaForm,
}

impl HyperbolaForm {
    /// `Δρ` in metre and its derivatives by the block's numbers.
    fn evaluate(self, numbers: &[f64], amplitude: f64) -> Result<(f64, [f64; 3]), EvaluationFailure> {
        let no_value = || EvaluationFailure::new("the radicand of Eq. 15 is negative");
        let no_slope = || EvaluationFailure::new("the slope of Eq. 15 is infinite");
        match self {
            Self::Coefficients(amplitude_span) => {
                let [h1, h2, h3] = *numbers else {
                    return Err(EvaluationFailure::new("the hyperbola has three coefficients"));
                };
                let hyperbola = AmplitudeHyperbola { h1, h2, h3, amplitude_span };
                let value = hyperbola.correction(amplitude).ok_or_else(no_value)?;
                Ok((value, hyperbola.jacobian(amplitude).ok_or_else(no_slope)?.coefficients))
            }
            Self::Real(lowest) => {
                let real = RealHyperbola::from_logarithms(numbers, lowest).ok_or_else(no_value)?;
                Ok((real.value(amplitude), real.derivatives(amplitude).ok_or_else(no_slope)?))
            }
        }
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
        let hyperbola = parameters.get(1).map(|numbers| self.form.evaluate(numbers, self.amplitude)).transpose()?;
        residual[0] -= hyperbola.map_or(0.0, |(value, _)| value);
        let Some(jacobians) = jacobians else { return Ok(()) };
        jacobians.row(0, 0).copy_from_slice(self.row);
        if let Some((_, derivatives)) = hyperbola {
            jacobians.row(1, 0).copy_from_slice(&derivatives);
        }
        Ok(())
    }
}
