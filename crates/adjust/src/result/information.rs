use crate::{Error, Result, Solution};

/// Whether the variance factor of the observations is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VarianceFactor {
    /// The covariances are right as they were given: −2 ln L = vᵀPv + const.
    Known,
    /// They are right up to a common factor, which is one more parameter: −2 ln L = n ln(vᵀPv / n) + const.
    Unknown,
}

/// Information criteria; the smaller, the better the model. They compare models of the **same observations with the
/// same covariances** (also the same exclusions, and no robust weights): what these have in common is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct InformationCriteria {
    /// Akaike: −2 ln L + 2k.
    pub aic: f64,
    /// Akaike's with the correction for small samples: AIC + 2k(k+1)/(n−k−1). Infinite where n ≤ k + 1.
    pub aicc: f64,
    /// Schwarz: −2 ln L + k ln n. Finds the right model as observations grow, where AIC may take too large a one.
    pub bic: f64,
    /// Observed values used, n.
    pub observations: usize,
    /// Parameters, k: unknowns less constraints (datum included), and one for an unknown variance factor.
    pub parameters: usize,
}

impl Solution {
    /// Akaike's and Schwarz's criteria \[Burnham2002\], \[Schwarz1978\].
    ///
    /// # Errors
    /// [`Error::NoRedundancy`] where an unknown variance factor cannot be estimated.
    pub fn information_criteria(&self, factor: VarianceFactor) -> Result<InformationCriteria> {
        let excluded = (0..self.observations()).filter(|&row| self.is_excluded(row)).count();
        let observations = self.observations() - excluded;
        // Redundancy is n + constraints − unknowns.
        let effective = (observations as i64 - self.redundancy()).max(0) as usize;
        let n = observations as f64;
        let (likelihood, parameters) = match factor {
            VarianceFactor::Known => (self.vtpv(), effective),
            VarianceFactor::Unknown if self.redundancy() > 0 => (n * (self.vtpv() / n).ln(), effective + 1),
            VarianceFactor::Unknown => return Err(Error::NoRedundancy { redundancy: self.redundancy() }),
        };
        let k = parameters as f64;
        let aic = likelihood + 2.0 * k;
        let rest = n - k - 1.0;
        let aicc = if rest > 0.0 { aic + 2.0 * k * (k + 1.0) / rest } else { f64::INFINITY };
        Ok(InformationCriteria { aic, aicc, bic: likelihood + k * n.ln(), observations, parameters })
    }
}
