use crate::{ComplexChannel, Error, Result};

/// Random noise of a raw sample: shot noise in proportion to the light, and dark noise that is always there.
///
/// `var(S) = shot_variance_per_unit * max(S, 0) + dark_sigma^2`, in the (scaled) unit of the samples. With N equidistant
/// phase steps each part of `z` then has the variance `2/N * mean(var(S))` (`[Lange2000]`), the mean sample being the
/// offset `B`; for N = 3 this is the mean of the two parts (see the crate's documentation).
///
/// Samples that are differences of two taps carry no offset, so that their shot noise cannot be told from them:
/// [`Samples::I16`](crate::Samples::I16) gets the dark noise alone.
///
/// The default has no noise at all, which means: not known. Sigma is then NaN.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct NoiseModel {
    /// Variance of the shot noise for each unit of the sample (counts per electron).
    pub shot_variance_per_unit: f64,
    /// Standard deviation of whatever does not depend on light: dark current, reset, amplifier, quantisation.
    pub dark_sigma: f64,
}

impl NoiseModel {
    /// Fails on values that are negative or not finite.
    pub fn validate(&self) -> Result<()> {
        for (name, value) in [("shot_variance_per_unit", self.shot_variance_per_unit), ("dark_sigma", self.dark_sigma)]
        {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::OutOfDomain { name, value, expected: "noise is finite and not negative" });
            }
        }
        Ok(())
    }

    /// Whether the model says anything: some noise is not zero.
    pub fn is_known(&self) -> bool {
        self.shot_variance_per_unit > 0.0 || self.dark_sigma > 0.0
    }

    /// Standard deviation of each part of `z` from `phase_steps` samples with the mean `offset`; NaN if nothing is known.
    pub fn sigma_z(&self, offset: f64, phase_steps: usize) -> f64 {
        if !self.is_known() {
            return f64::NAN;
        }
        // `max` would turn a NaN offset into zero and so into a sigma.
        let light = if offset < 0.0 { 0.0 } else { offset };
        let variance = self.shot_variance_per_unit * light + self.dark_sigma * self.dark_sigma;
        (2.0 / phase_steps as f64 * variance).sqrt()
    }
}

impl ComplexChannel {
    /// Predicts [`Self::sigma`](ComplexChannel::sigma) from the offset plane, for data that was demodulated elsewhere.
    ///
    /// Without an offset plane only the dark noise is known; pixels without a value get NaN.
    pub fn predict_sigma(&mut self, noise: &NoiseModel, phase_steps: usize) -> Result<()> {
        noise.validate()?;
        let dark = NoiseModel { shot_variance_per_unit: 0.0, ..*noise }.sigma_z(0.0, phase_steps) as f32;
        let parts = self.real.as_slice().iter().zip(self.imaginary.as_slice());
        match &self.offset {
            None => {
                for (sigma, (re, im)) in self.sigma.as_mut_slice().iter_mut().zip(parts) {
                    *sigma = if re.is_finite() && im.is_finite() { dark } else { f32::NAN };
                }
            }
            Some(offset) => {
                let pixels = self.sigma.as_mut_slice().iter_mut().zip(offset.as_slice()).zip(parts);
                for ((sigma, offset), (re, im)) in pixels {
                    let predicted = noise.sigma_z(f64::from(*offset), phase_steps) as f32;
                    *sigma = if re.is_finite() && im.is_finite() { predicted } else { f32::NAN };
                }
            }
        }
        Ok(())
    }
}
