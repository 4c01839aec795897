//! What repeated values of one quantity say of their variance.

/// Repeated values of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Repeats {
    /// Number of the pixel among those of all stations: what moves, moves in all its values.
    pub(super) pixel: usize,
    /// What the variance depends on linearly.
    pub(super) regressor: f64,
    /// Variance of the regressor by its own noise.
    pub(super) regressor_variance: f64,
    /// `Σ (x − mean)² / (n − 1)`.
    pub(super) variance: f64,
    /// `Σ (x_i+1 − x_i)² / 2 (n − 1)`: blind to a slow drift (`[vonNeumann1941]`).
    pub(super) successive: f64,
    /// Number n of values.
    pub(super) count: usize,
}

impl Repeats {
    /// `None` below two values. Pixel and the regressor's own noise are said later.
    pub(super) fn of(values: &[f64], regressor: f64) -> Option<Self> {
        let count = values.len();
        if count < 2 {
            return None;
        }
        let mean = mean_of(values);
        let degrees = count as f64 - 1.0;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / degrees;
        let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>();
        Some(Self { pixel: 0, regressor, regressor_variance: 0.0, variance, successive: 0.5 * steps / degrees, count })
    }
}

pub(super) fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
