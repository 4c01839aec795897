use crate::{Distribution, Error, GroupId, ObservationId, Result, Solution};

/// Redundancy number below which rounding decides on a residual.
pub(crate) const SMALLEST_CONTROL: f64 = 1e-6;

/// σ̂₀ below which the residuals are rounding errors.
const SMALLEST_SIGMA0: f64 = 1e-8;

/// Which variance factor a test for gross errors relies on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SnoopingTest {
    /// Baarda's w: the prior standard deviations are right \[Baarda1968\].
    #[default]
    Baarda,
    /// Pope's τ: they are right up to one common factor, which is estimated \[Pope1976\].
    Pope,
}

impl SnoopingTest {
    /// Critical value of w, in prior standard deviations, with vᵀPv and redundancy of the adjustment. NaN where there
    /// is no test.
    pub(crate) fn critical(self, level: f64, vtpv: f64, redundancy: f64) -> Critical {
        match self {
            Self::Baarda => Critical { value: Distribution::Normal.critical(level), sigma0: 1.0 },
            Self::Pope => {
                let sigma0 = (vtpv / redundancy).sqrt();
                let tested = redundancy > 1.0 && sigma0 > SMALLEST_SIGMA0;
                let value = Distribution::Tau { dof: redundancy }.critical(level);
                Critical { value: if tested { value } else { f64::NAN }, sigma0 }
            }
        }
    }
}

/// A critical value, and the standard deviation of unit weight that it is measured in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Critical {
    pub(crate) value: f64,
    pub(crate) sigma0: f64,
}

/// The test of every observed value for a gross error of its own.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct OutlierTest {
    /// The test.
    pub test: SnoopingTest,
    /// Significance level of a single test.
    pub level: f64,
    /// Value that the statistics exceed with this probability; NaN where nothing can be tested.
    pub critical: f64,
    /// One statistic a component, in the order of [`Solution::residuals`]; NaN where an error would not show (redundancy
    /// below 1e-6). For an excluded component that of its prediction.
    pub statistics: Vec<f64>,
    /// Components that are used and exceed the critical value, largest first.
    pub suspects: Vec<Suspect>,
}

/// An observed value that exceeds the critical value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suspect {
    /// Observation.
    pub observation: ObservationId,
    /// Its component.
    pub component: usize,
    /// Group of the observation.
    pub group: GroupId,
    /// w or τ.
    pub statistic: f64,
}

/// What one component contributes to tests, with p its row of the weight matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Control {
    /// `pᵀv`, whose expectation an error ∇ of this component alone makes `information · ∇`.
    pub(crate) pull: f64,
    /// Variance of `pᵀv`: `(P Q_vv P)ₖₖ`.
    pub(crate) information: f64,
    /// `Pₖₖ`.
    pub(crate) weight: f64,
    /// `(P A Q Aᵀ P)ₖₖ`.
    pub(crate) shared: f64,
}

impl Control {
    /// Share of the component's weight that checks it: the redundancy number where it is not correlated with others.
    pub(crate) fn share(&self) -> f64 {
        self.information / self.weight
    }

    /// Baarda's w: `pᵀv / σ`, most powerful against an error of this component alone.
    pub(crate) fn statistic(&self) -> f64 {
        if self.share() > SMALLEST_CONTROL { self.pull / self.information.sqrt() } else { f64::NAN }
    }
}

impl Solution {
    /// Tests every observed value for a gross error. Within an observation of several correlated components each is
    /// tested in its own direction: `w = pᵀv / √(pᵀ Q_vv p)` with p its row of P, which is `v / σ_v` where it is not
    /// correlated.
    ///
    /// Nothing is rejected here, see [`crate::Adjustment::solve_snooping`]. Observations with robust weights are measured
    /// against the weighted solution.
    pub fn snoop(&self, test: SnoopingTest, level: f64) -> Result<OutlierTest> {
        check_probability("level", level)?;
        let critical = test.critical(level, self.vtpv(), self.redundancy() as f64);
        let statistics: Vec<f64> =
            self.controls().iter().map(|control| control.statistic() / critical.sigma0).collect();
        let mut suspects = Vec::new();
        for (index, (place, &group)) in self.layout.observations.iter().zip(&self.group_of).enumerate() {
            for (component, row) in place.rows().enumerate() {
                if statistics[row].abs() > critical.value && !self.is_excluded(row) {
                    let (observation, statistic) = (ObservationId(index), statistics[row]);
                    suspects.push(Suspect { observation, component, group, statistic });
                }
            }
        }
        suspects.sort_by(|a, b| b.statistic.abs().total_cmp(&a.statistic.abs()));
        Ok(OutlierTest { test, level, critical: critical.value, statistics, suspects })
    }

    /// The controls of all components, in the order of the residuals.
    pub(crate) fn controls(&self) -> Vec<Control> {
        let mut out = Vec::with_capacity(self.observations());
        self.for_each_observation(|place, local| {
            let d = place.dimension;
            let whitened = &self.linearisation.whitened[place.rows()];
            for (component, row) in place.rows().enumerate() {
                // p = column `component` of WᵀW; in whitened residuals it is that column of W.
                let own = |i: usize| local.whitening(i, component);
                let (mut pull, mut weight, mut shared) = (0.0, 0.0, 0.0);
                for i in component..d {
                    pull += own(i) * whitened[i];
                    weight += own(i) * own(i);
                    shared += (component..d).map(|j| own(i) * local.image[i * d + j] * own(j)).sum::<f64>();
                }
                // With the robust weight w the variance of the residual is C + (1 − 2w) A Q Aᵀ.
                let information = weight + (1.0 - 2.0 * self.weights()[row]) * shared;
                out.push(Control { pull, information, weight, shared });
            }
        });
        out
    }
}

pub(crate) fn check_probability(name: &'static str, value: f64) -> Result<()> {
    let good = value > 0.0 && value < 1.0;
    if good { Ok(()) } else { Err(Error::Option { name, value, expected: "a probability between 0 and 1" }) }
}
