use std::fmt;

use crate::testing::outlier::check_probability;
use crate::{Distribution, Error, GroupId, Result, Solution};

/// What the residuals say about the standard deviations given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GlobalVerdict {
    /// Residuals are as large as the standard deviations let expect.
    AsStated,
    /// Residuals are too large: gross errors, a model that does not describe what was observed, or standard deviations
    /// that are too small (wrong units, perhaps).
    TooLarge,
    /// Residuals are too small: standard deviations are too large, or values were smoothed or made from each other.
    TooSmall,
}

/// The global test of the adjustment: whether the variance factor is one, two-sided.
///
/// Where all covariances are right, errors are normal and the model holds, `vᵀPv` of a whole adjustment has the
/// distribution χ² with the redundancy as its degrees of freedom, and `level` is the probability that a sound
/// adjustment fails. What was rejected before by its size ([`crate::Adjustment::solve_snooping`]) makes `vᵀPv` a little too
/// small.
///
/// ```
/// use adjust::{GlobalTest, GlobalVerdict};
///
/// # fn main() -> Result<(), adjust::Error> {
/// // 18.307 is exceeded with 5 %, 3.940 not reached with 5 %, by χ² of 10 degrees of freedom.
/// let test = GlobalTest::new("heights", 20.0, 10.0, 0.10)?;
/// assert!((test.limits.0 - 3.940).abs() < 5e-4 && (test.limits.1 - 18.307).abs() < 5e-4);
/// assert_eq!(test.verdict, GlobalVerdict::TooLarge);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct GlobalTest {
    /// What was tested: the name of the group, or `all observations`.
    pub subject: String,
    /// `vᵀPv`.
    pub statistic: f64,
    /// Redundancy: what `vᵀPv` is on average.
    pub redundancy: f64,
    /// Degrees of freedom of the scaled χ² that `vᵀPv` is held against: the redundancy for the whole. For a group,
    /// whose residuals depend on the others', those with its mean and variance \[Satterthwaite1946\].
    pub degrees: f64,
    /// What `vᵀPv` lies between with probability 1 − level where all is sound.
    pub limits: (f64, f64),
    /// Probability of a `vᵀPv` at least as far off, on either side, where all is sound.
    pub p_value: f64,
    /// Significance level: probability of a verdict against something sound.
    pub level: f64,
    /// The verdict at that level.
    pub verdict: GlobalVerdict,
}

impl GlobalTest {
    /// Tests `statistic` = `vᵀPv` with its redundancy at a significance level (0.05, for example).
    ///
    /// # Errors
    /// [`Error::Untestable`] without redundancy or where `vᵀPv` is not finite; [`Error::Option`] for a level that is no
    /// probability.
    pub fn new(subject: impl Into<String>, statistic: f64, redundancy: f64, level: f64) -> Result<Self> {
        Self::scaled(subject.into(), statistic, redundancy, redundancy, level)
    }

    /// `statistic · degrees / redundancy` is χ² with `degrees`.
    fn scaled(subject: String, statistic: f64, redundancy: f64, degrees: f64, level: f64) -> Result<Self> {
        check_probability("level", level)?;
        let untestable = |reason| Error::Untestable { what: format!("the variance factor of {subject}"), reason };
        if !(redundancy > 0.0 && redundancy.is_finite() && degrees > 0.0) {
            return Err(untestable("there is no redundancy"));
        }
        if !(statistic >= 0.0 && statistic.is_finite()) {
            return Err(untestable("the sum of squared residuals is no finite number"));
        }
        let (distribution, unit) = (Distribution::ChiSquared { dof: degrees }, redundancy / degrees);
        let (below, above) = (distribution.cumulative(statistic / unit), distribution.survival(statistic / unit));
        let p_value = (2.0 * below.min(above)).min(1.0);
        let limits = (unit * distribution.quantile(0.5 * level), unit * distribution.upper_quantile(0.5 * level));
        let verdict = match p_value < level {
            false => GlobalVerdict::AsStated,
            true if below < above => GlobalVerdict::TooSmall,
            true => GlobalVerdict::TooLarge,
        };
        Ok(Self { subject, statistic, redundancy, degrees, limits, p_value, level, verdict })
    }

    /// `√(vᵀPv / redundancy)`: by how much the standard deviations seem to be larger than they were given.
    pub fn sigma0(&self) -> f64 {
        (self.statistic / self.redundancy).sqrt()
    }
}

impl fmt::Display for GlobalTest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bound = |limit: f64| (limit / self.redundancy).sqrt();
        let verdict = match self.verdict {
            GlobalVerdict::AsStated => "as the standard deviations let expect",
            GlobalVerdict::TooLarge => "residuals too large for the standard deviations",
            GlobalVerdict::TooSmall => "residuals too small for the standard deviations",
        };
        write!(
            f,
            "{}: sigma0 {:.4}, {:.4} to {:.4} expected at the {} % level (redundancy {:.1}, p = {:.2e}): {verdict}",
            self.subject,
            self.sigma0(),
            bound(self.limits.0),
            bound(self.limits.1),
            100.0 * self.level,
            self.redundancy,
            self.p_value
        )
    }
}

impl Solution {
    /// The global test of the whole adjustment at a significance level.
    ///
    /// # Errors
    /// [`Error::Untestable`] without redundancy, or where a robust kernel took part of the weight from an observation:
    /// its sum of squares has another distribution. [`Error::Option`] for a level that is no probability.
    pub fn global_test(&self, level: f64) -> Result<GlobalTest> {
        self.check_weights(None)?;
        GlobalTest::new("all observations", self.vtpv(), self.redundancy() as f64, level)
    }

    /// The global test of every group that has redundancy, in the order of adding. A group that fails says more than
    /// the whole: which covariances, or which part of the model, are wrong. With k groups, one of them fails by chance
    /// with up to k times the level.
    ///
    /// Mean and variance of a group's `vᵀPv` are exact, its tails nearly so: a group that other groups leave less than a
    /// few degrees of freedom, in unequal parts, is rejected less often than `level` says (half as often, or less).
    /// With more than 1,200 unknowns the degrees of freedom are taken for the redundancy, as if groups did not share it:
    /// sound groups are then rejected less often as well.
    ///
    /// # Errors
    /// As [`Self::global_test`].
    pub fn group_tests(&self, level: f64) -> Result<Vec<GlobalTest>> {
        let mut tests = Vec::with_capacity(self.groups.len());
        for group in (0..self.groups.len()).map(GroupId) {
            let figures = self.group(group)?;
            if figures.sigma0().is_none() {
                continue;
            }
            self.check_weights(Some(group))?;
            // vᵀPv of the group is a sum of λᵢχ²(1), with Σλ = redundancy and Σλ² = Σ R² over the group's own part.
            let squares = self.component_information(&[group]).map_or(figures.redundancy, |r| r[(0, 0)]);
            let degrees = figures.redundancy * figures.redundancy / squares;
            tests.push(GlobalTest::scaled(figures.name, figures.vtpv, figures.redundancy, degrees, level)?);
        }
        Ok(tests)
    }

    fn check_weights(&self, group: Option<GroupId>) -> Result<()> {
        let chosen = self.layout.observations.iter().zip(&self.group_of);
        let chosen = chosen.filter(|(_, of)| group.is_none_or(|group| group == **of));
        let mut rows = chosen.flat_map(|(place, _)| place.rows()).filter(|&row| !self.is_excluded(row));
        let Some(row) = rows.find(|&row| self.weights()[row] < 1.0) else { return Ok(()) };
        let what = format!("the variance factor (value {row} has the robust weight {:.3})", self.weights()[row]);
        Err(Error::Untestable { what, reason: "with robust weights the sum of squares is not distributed as χ²" })
    }
}
