//! Two sets of parameters, each with its covariance.

use nalgebra::{DMatrix, DVector};
use statistics::{Distribution, holm};

use super::{require_covariance, require_level};
use crate::{Error, Result};

/// Part of the largest eigenvalue of a correlation matrix below which a combination counts as exactly known.
const DEPENDENT: f64 = 1e-10;

/// Named parameters with their covariance; the variance of a held one is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSet {
    /// Names, each once.
    pub names: Vec<String>,
    /// Values in the order of the names.
    pub values: Vec<f64>,
    /// Covariance in the order of the names.
    pub covariance: DMatrix<f64>,
}

/// One parameter of both sets.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterDifference {
    /// Name.
    pub name: String,
    /// Value in the first set and in the second.
    pub values: [f64; 2],
    /// Standard deviations there; zero where it was held.
    pub sigmas: [f64; 2],
    /// Second minus first.
    pub difference: f64,
    /// Standard deviation of the difference; zero where it was held in both.
    pub sigma: f64,
    /// Probability of so large a difference by chance, by itself; NaN where it was held in both.
    pub p_value: f64,
    /// The same with all other parameters minded `[Holm1979]`.
    pub p_value_of_all: f64,
    /// Whether that is below the level; of a parameter held in both, whether the values differ.
    pub significant: bool,
}

/// All common parameters at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTest {
    /// `dᵀ (C₁ + C₂)⁻¹ d`.
    pub statistic: f64,
    /// Degrees of freedom: parameters estimated in at least one set, less exact combinations.
    pub degrees: usize,
    /// Probability of so much by chance.
    pub p_value: f64,
    /// Whether that is below the level.
    pub significant: bool,
}

/// What is different, and whether it matters.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterComparison {
    /// Common parameters in the order of the first set.
    pub differences: Vec<ParameterDifference>,
    /// The test of all of them; `None` where all are held.
    pub joint: Option<JointTest>,
    /// Names in the first set alone.
    pub only_first: Vec<String>,
    /// Names in the second set alone.
    pub only_second: Vec<String>,
}

/// Compares the parameters that two sets from independent observations have in common: each by a normal test, the
/// smallest probabilities against the level after Holm `[Holm1979]`, and all together by a χ² test.
///
/// # Errors
/// [`Error::OutOfDomain`] for a level, covariance or lists that cannot be; [`Error::DuplicateName`].
pub fn compare_parameters(first: &ParameterSet, second: &ParameterSet, level: f64) -> Result<ParameterComparison> {
    require_level(level)?;
    first.validate()?;
    second.validate()?;
    let common: Vec<[usize; 2]> = first
        .names
        .iter()
        .enumerate()
        .filter_map(|(i, name)| second.names.iter().position(|other| other == name).map(|j| [i, j]))
        .collect();
    let mut differences: Vec<ParameterDifference> =
        common.iter().map(|&[i, j]| difference(first, i, second, j)).collect();
    mind_multiplicity(&mut differences, level);
    let joint = joint_test(first, second, &common, level);
    let lacks = |names: &[String], others: &[String]| -> Vec<String> {
        names.iter().filter(|name| !others.contains(name)).cloned().collect()
    };
    let (only_first, only_second) = (lacks(&first.names, &second.names), lacks(&second.names, &first.names));
    Ok(ParameterComparison { differences, joint, only_first, only_second })
}

impl ParameterSet {
    fn validate(&self) -> Result<()> {
        if self.values.len() != self.names.len() {
            let (value, expected) = (self.values.len() as f64, "one value a name");
            return Err(Error::OutOfDomain { name: "number of values", value, expected });
        }
        let twice = self.names.iter().enumerate().find(|(index, name)| self.names[..*index].contains(name));
        if let Some((_, name)) = twice {
            return Err(Error::DuplicateName { kind: "parameter", name: name.clone() });
        }
        if let Some(&value) = self.values.iter().find(|value| !value.is_finite()) {
            return Err(Error::OutOfDomain { name: "value of a parameter", value, expected: "a finite number" });
        }
        require_covariance(&self.covariance, self.names.len())
    }
}

fn difference(first: &ParameterSet, i: usize, second: &ParameterSet, j: usize) -> ParameterDifference {
    let variances = [first.covariance[(i, i)], second.covariance[(j, j)]];
    let (values, sigma) = ([first.values[i], second.values[j]], (variances[0] + variances[1]).sqrt());
    let difference = values[1] - values[0];
    let p_value = if sigma > 0.0 { Distribution::Normal.p_value(difference / sigma) } else { f64::NAN };
    ParameterDifference {
        name: first.names[i].clone(),
        values,
        sigmas: variances.map(f64::sqrt),
        difference,
        sigma,
        p_value,
        p_value_of_all: f64::NAN,
        significant: sigma == 0.0 && difference != 0.0,
    }
}

/// Parameters that are held have no probability; their verdict stands.
fn mind_multiplicity(differences: &mut [ParameterDifference], level: f64) {
    let of_all = holm(&differences.iter().map(|difference| difference.p_value).collect::<Vec<f64>>());
    for (difference, p_value) in differences.iter_mut().zip(of_all).filter(|(_, p_value)| p_value.is_finite()) {
        difference.p_value_of_all = p_value;
        difference.significant = p_value < level;
    }
}

fn joint_test(first: &ParameterSet, second: &ParameterSet, common: &[[usize; 2]], level: f64) -> Option<JointTest> {
    let free: Vec<[usize; 2]> =
        common.iter().copied().filter(|&[i, j]| first.covariance[(i, i)] + second.covariance[(j, j)] > 0.0).collect();
    if free.is_empty() {
        return None;
    }
    let covariance = |k: usize, l: usize| {
        let ([i, j], [m, n]) = (free[k], free[l]);
        first.covariance[(i, m)] + second.covariance[(j, n)]
    };
    // In standard deviations, so that units do not matter.
    let sigma: Vec<f64> = (0..free.len()).map(|k| covariance(k, k).sqrt()).collect();
    let correlation = DMatrix::from_fn(free.len(), free.len(), |k, l| covariance(k, l) / (sigma[k] * sigma[l]));
    let scaled = free.iter().zip(&sigma).map(|(&[i, j], sigma)| (second.values[j] - first.values[i]) / sigma);
    let scaled = DVector::from_iterator(free.len(), scaled);
    let eigen = correlation.symmetric_eigen();
    let limit = DEPENDENT * eigen.eigenvalues.max();
    let kept = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(value, _)| **value > limit);
    let (statistic, degrees) = kept.fold((0.0, 0), |(sum, degrees), (value, direction)| {
        (sum + direction.dot(&scaled).powi(2) / value, degrees + 1)
    });
    let p_value = Distribution::ChiSquared { dof: degrees as f64 }.p_value(statistic);
    Some(JointTest { statistic, degrees, p_value, significant: p_value < level })
}
