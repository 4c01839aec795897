//! Serial correlation of block means, after Prais and Winsten.

use crate::DriftBlock;

/// Makes blocks with correlated neighbours into independent ones of unit variance.
///
/// Errors over their standard deviations follow `e_i = φ^(Δt/L) e_(i−1) + noise`, L the length of a block; the first
/// one is kept (`[PraisWinsten1954]`).
#[derive(Debug, Clone)]
pub(crate) struct Whitening {
    sigmas: Vec<f64>,
    /// Correlation with the block before; zero for the first.
    correlations: Vec<f64>,
}

impl Whitening {
    pub(crate) fn new(blocks: &[DriftBlock], length_s: f64, autocorrelation: f64) -> Self {
        let with_before = |pair: &[DriftBlock]| autocorrelation.powf((pair[1].time_s - pair[0].time_s) / length_s);
        Self {
            sigmas: blocks.iter().map(|block| block.sigma_m).collect(),
            correlations: std::iter::once(0.0).chain(blocks.windows(2).map(with_before)).collect(),
        }
    }

    /// One whitened value from that of a block and of the one before (none for the first).
    pub(crate) fn one(&self, index: usize, value: f64, before: f64) -> f64 {
        let own = value / self.sigmas[index];
        if index == 0 {
            return own;
        }
        let correlation = self.correlations[index];
        (own - correlation * before / self.sigmas[index - 1]) / (1.0 - correlation * correlation).sqrt()
    }

    /// All values of a column.
    pub(crate) fn column(&self, values: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut before = 0.0;
        let one = |(index, value)| self.one(index, value, std::mem::replace(&mut before, value));
        values.into_iter().enumerate().map(one).collect()
    }

    pub(crate) fn len(&self) -> usize {
        self.sigmas.len()
    }
}

/// Lag-one autocorrelation of residuals over their standard deviations, zero at least.
///
/// Residuals of a fit with p smooth unknowns are less correlated than the errors, by `2 φ / n` and `p (1 + φ) / n`
/// (`[MarriottPope1954]`), which is put back. A negative one is taken for zero, which makes no deviation smaller.
pub(crate) fn autocorrelation(standardised: &[f64], unknowns: usize) -> f64 {
    let squares: f64 = standardised.iter().map(|e| e * e).sum();
    if squares <= 0.0 {
        return 0.0;
    }
    let products: f64 = standardised.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let (n, p) = (standardised.len() as f64, unknowns as f64);
    ((products / squares + p / n) / (1.0 - (2.0 + p) / n)).clamp(0.0, 1.0)
}
