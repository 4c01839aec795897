use crate::testing::outlier::{SMALLEST_CONTROL, check_probability};
use crate::{BlockId, Distribution, ObservationId, Result, Scale, Solution};

/// What counts as found by the test for gross errors \[Baarda1968\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReliabilityOptions {
    /// Probability that a good observation is rejected. Default: 0.001.
    pub level: f64,
    /// Probability that an error of the size of the smallest detectable one is found. Default: 0.8.
    pub power: f64,
}

impl Default for ReliabilityOptions {
    fn default() -> Self {
        Self { level: 0.001, power: 0.80 }
    }
}

impl ReliabilityOptions {
    /// Expectation of w at which the test has its power: δ₀ = z(1 − level/2) + z(power), 4.13 by default. (Rejection on
    /// the wrong side, of probability below 1e-4 for usual levels, is left out, as usual.)
    pub fn noncentrality(&self) -> Result<f64> {
        check_probability("level", self.level)?;
        check_probability("power", self.power)?;
        Ok(Distribution::Normal.critical(self.level) + Distribution::Normal.quantile(self.power))
    }
}

/// Internal reliability of one observed value, and the size of what it may do to the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ComponentReliability {
    /// Share of an error that shows, 0 to 1: `(P Q_vv P)ₖₖ / Pₖₖ`, the redundancy number where the component is not
    /// correlated with others.
    pub control: f64,
    /// Smallest gross error that the test finds (with the given power), ∇₀, unit of the observation. Infinite where
    /// nothing checks it.
    pub smallest_detectable: f64,
    /// √(∇x₀ᵀ N ∇x₀) for the effect ∇x₀ of that error on all unknowns, δ̄₀: no function of the unknowns moves by more than
    /// this many of its prior standard deviations. Infinite where nothing checks it.
    pub bar_delta: f64,
}

/// What the smallest detectable error of one observed value does to chosen parameters.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ExternalReliability {
    /// Internal reliability of the observed value.
    pub internal: ComponentReliability,
    /// Effect ∇x₀ on the blocks asked for (tangent step), in their order.
    pub effects: Vec<(BlockId, Vec<f64>)>,
    /// Largest ratio of an effect to the prior standard deviation of its parameter; never above `bar_delta`.
    pub largest_ratio: f64,
    /// Block and component of the largest ratio; `None` where no parameter moves.
    pub largest: Option<(BlockId, usize)>,
}

impl Solution {
    /// Internal reliability of all observed values, in the order of [`Self::residuals`]. Prior-scaled. What is excluded is
    /// measured by the error that would be found if it were admitted to this solution.
    pub fn reliability(&self, options: &ReliabilityOptions) -> Result<Vec<ComponentReliability>> {
        let delta = options.noncentrality()?;
        let measure = |control: &crate::testing::outlier::Control| {
            let share = control.share();
            if share.is_nan() || share <= SMALLEST_CONTROL {
                let infinite = f64::INFINITY;
                return ComponentReliability { control: 0.0, smallest_detectable: infinite, bar_delta: infinite };
            }
            ComponentReliability {
                control: share.min(1.0),
                smallest_detectable: delta / control.information.sqrt(),
                bar_delta: delta * (control.shared.max(0.0) / control.information).sqrt(),
            }
        };
        Ok(self.controls().iter().map(measure).collect())
    }

    /// External reliability: `∇x₀ = Q Aᵀ P eₖ ∇₀` on the blocks given.
    ///
    /// # Errors
    /// The observation, its component or a block does not exist. Where nothing checks the component the effects are
    /// infinite (NaN where they are zero times infinite).
    pub fn external_reliability(
        &self,
        observation: ObservationId,
        component: usize,
        blocks: &[BlockId],
        options: &ReliabilityOptions,
    ) -> Result<ExternalReliability> {
        let row = self.row(observation, component)?;
        let internal = self.reliability(options)?[row];
        let used = if self.is_excluded(row) { 0.0 } else { self.weights()[row] };
        let moved = self.spread(&self.weighted_design(row));
        let (mut effects, mut largest_ratio, mut largest) = (Vec::new(), 0.0, None);
        for &block in blocks {
            let mut effect = vec![0.0; self.tangent_dimension(block)?];
            for (component, effect) in effect.iter_mut().enumerate() {
                if let Some(column) = self.unknown_index(block, component)? {
                    *effect = moved[column] * internal.smallest_detectable * used;
                }
            }
            for (component, (sigma, moved)) in
                self.standard_deviations(block, Scale::Prior)?.into_iter().zip(&effect).enumerate()
            {
                let ratio = moved.abs() / sigma;
                if sigma > 0.0 && ratio > largest_ratio {
                    (largest_ratio, largest) = (ratio, Some((block, component)));
                }
            }
            effects.push((block, effect));
        }
        Ok(ExternalReliability { internal, effects, largest_ratio, largest })
    }
}
