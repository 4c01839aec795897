use crate::{DriftError, DriftResult};

/// How a drift is estimated, and what is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftOptions {
    /// Most blocks of equal length that samples are averaged over. Default 200.
    pub blocks: usize,
    /// Probability with which noise alone makes one exponential more, or a drift that follows the frame rate. Default 1 %.
    pub level: f64,
    /// Whether the drift may follow the temperature. Default: not.
    pub temperature: TemperatureUse,
    /// Drift within which the camera counts as stable, metre; `None`, the default: three standard deviations of a block
    /// in the last quarter of the capture.
    pub tolerance_m: Option<f64>,
    /// Shortest capture that is taken for an answer, second. Default 10 min: transients take tens of minutes (Sect.
    /// 4.7), and what is slower than the capture passes for a constant.
    pub least_duration_s: f64,
    /// Largest correlation of neighbouring blocks beside the model: beyond it, the residuals wander as no noise does.
    /// Default 0.9.
    pub largest_autocorrelation: f64,
}

/// Whether the drift may follow the temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TemperatureUse {
    /// Transients alone.
    #[default]
    Ignore,
    /// A part proportional to the temperature is estimated beside the transients.
    Estimate,
}

impl Default for DriftOptions {
    fn default() -> Self {
        Self {
            blocks: 200,
            level: 0.01,
            temperature: TemperatureUse::Ignore,
            tolerance_m: None,
            least_duration_s: 600.0,
            largest_autocorrelation: 0.9,
        }
    }
}

impl DriftOptions {
    /// Fewest blocks that tell a curve of eight unknowns and a serial correlation from noise.
    pub const LEAST_BLOCKS: usize = 30;

    /// Refuses values outside their domain.
    pub fn validate(&self) -> DriftResult<()> {
        let share = |value: f64| value > 0.0 && value < 1.0;
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let tolerance_m = self.tolerance_m.unwrap_or(1.0);
        for (name, value, holds, expected) in [
            ("blocks", self.blocks as f64, self.blocks >= Self::LEAST_BLOCKS, "at least 30 blocks"),
            ("level", self.level, share(self.level), "a probability between 0 and 1"),
            ("tolerance_m", tolerance_m, positive(tolerance_m), "a positive length"),
            ("least_duration_s", self.least_duration_s, positive(self.least_duration_s), "a positive time"),
            (
                "largest_autocorrelation",
                self.largest_autocorrelation,
                share(self.largest_autocorrelation),
                "a correlation between 0 and 1",
            ),
        ] {
            if !holds {
                return Err(DriftError::OutOfDomain { name, value, expected });
            }
        }
        Ok(())
    }
}
