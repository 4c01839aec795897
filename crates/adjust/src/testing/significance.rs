use nalgebra::{DMatrix, DVector};

use crate::{BlockId, Distribution, Error, Result, Scale, Solution};

/// Pivot of a correlation matrix below which parameters are taken for dependent on each other.
const DEPENDENT: f64 = 1e-11;

/// A test of the hypothesis that parameters have given values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Significance {
    /// For one parameter `(x − x₀)/σ`, with its sign. For several, with `d = x − x₀`: `dᵀQ⁻¹d` (prior) or `dᵀQ⁻¹d / (m σ̂₀²)`
    /// (posterior).
    pub statistic: f64,
    /// Distribution of the statistic where the hypothesis holds: normal or t for one parameter, χ² or F for several
    /// (prior or posterior).
    pub distribution: Distribution,
    /// Probability of a statistic at least as far off where the hypothesis holds: small means significant.
    pub p_value: f64,
}

impl Solution {
    /// Tests whether single parameters (one or several, each a block and a component) differ from zero. All of them
    /// together: pairs of sine and cosine, or all terms of a kind, belong into one test.
    ///
    /// # Errors
    /// [`Error::Untestable`] for parameters that are held, fixed by constraints, dependent on each other, named twice, or
    /// on a manifold that has no zero (see [`Self::significance_of_change`]); [`Error::NoRedundancy`] for the posterior
    /// scale.
    pub fn significance(&self, parameters: &[(BlockId, usize)], scale: Scale) -> Result<Significance> {
        let with_values: Vec<_> = parameters.iter().map(|&(block, component)| (block, component, 0.0)).collect();
        self.significance_against(&with_values, scale)
    }

    /// Tests whether parameters (block, component, value x₀) differ from given values. Errors as [`Self::significance`].
    pub fn significance_against(&self, parameters: &[(BlockId, usize, f64)], scale: Scale) -> Result<Significance> {
        let mut difference = Vec::with_capacity(parameters.len());
        for &(block, component, expected) in parameters {
            let count = self.tangent_dimension(block)?;
            let values = self.values(block)?;
            if values.len() != count {
                return Err(self.untestable(block, "its values are no plain numbers"));
            }
            let unknown = Error::UnknownId { what: "parameter", index: component, count };
            difference.push(values.get(component).ok_or(unknown)? - expected);
        }
        let chosen: Vec<_> = parameters.iter().map(|&(block, component, _)| (block, component)).collect();
        self.test(&chosen, &DVector::from_vec(difference), scale)
    }

    /// Tests whether a whole block (a pose, for example) differs from given values (ambient), with the difference in its
    /// tangent space. Held components are left out. Errors as [`Self::significance`].
    pub fn significance_of_change(&self, block: BlockId, expected: &[f64], scale: Scale) -> Result<Significance> {
        let difference = self.difference(block, expected)?;
        let mut free = Vec::new();
        for component in 0..difference.len() {
            if self.unknown_index(block, component)?.is_some() {
                free.push((block, component));
            }
        }
        let difference = DVector::from_iterator(free.len(), free.iter().map(|&(_, component)| difference[component]));
        self.test(&free, &difference, scale)
    }

    fn test(&self, parameters: &[(BlockId, usize)], difference: &DVector<f64>, scale: Scale) -> Result<Significance> {
        let covariance = self.covariance_of_parameters(parameters)?;
        let variance = self.variance_factor(scale)?;
        let dof = self.redundancy() as f64;
        let count = parameters.len() as f64;
        let deviation = covariance.diagonal().map(f64::sqrt);
        let scaled = difference.component_div(&deviation);
        let (statistic, distribution) = if parameters.len() == 1 {
            let distribution = match scale {
                Scale::Prior => Distribution::Normal,
                Scale::Posterior => Distribution::StudentT { dof },
            };
            (scaled[0] / variance.sqrt(), distribution)
        } else {
            let correlation = covariance.component_div(&(&deviation * deviation.transpose()));
            let factor = correlation.cholesky().filter(|factor| factor.l_dirty().diagonal().min().powi(2) > DEPENDENT);
            let dependent = "they depend on each other or are fixed by constraints";
            let what = || format!("the {} parameters from `{}`", parameters.len(), self.parameter_name(parameters[0]));
            let factor = factor.ok_or_else(|| Error::Untestable { what: what(), reason: dependent })?;
            let square = scaled.dot(&factor.solve(&scaled));
            match scale {
                Scale::Prior => (square, Distribution::ChiSquared { dof: count }),
                Scale::Posterior => {
                    (square / (count * variance), Distribution::Fisher { numerator: count, denominator: dof })
                }
            }
        };
        Ok(Significance { statistic, distribution, p_value: distribution.p_value(statistic) })
    }

    /// Prior-scaled covariance matrix of single parameters, all of which are free and have a variance.
    fn covariance_of_parameters(&self, parameters: &[(BlockId, usize)]) -> Result<DMatrix<f64>> {
        if parameters.is_empty() {
            return Err(Error::Untestable { what: "significance".to_owned(), reason: "no parameters are named" });
        }
        for (index, &(block, component)) in parameters.iter().enumerate() {
            if self.unknown_index(block, component)?.is_none() {
                return Err(self.untestable(block, "a parameter of it is held"));
            }
            if parameters[..index].contains(&(block, component)) {
                return Err(self.untestable(block, "a parameter of it is named twice"));
            }
        }
        let mut blocks: Vec<BlockId> = parameters.iter().map(|&(block, _)| block).collect();
        blocks.sort_unstable();
        blocks.dedup();
        let offsets = self.offsets(&blocks)?;
        let joint = self.covariance_of(&blocks, Scale::Prior)?;
        let place = |&(block, component): &(BlockId, usize)| {
            blocks.binary_search(&block).map_or(0, |index| offsets[index]) + component
        };
        let places: Vec<usize> = parameters.iter().map(place).collect();
        let out = DMatrix::from_fn(places.len(), places.len(), |row, column| joint[(places[row], places[column])]);
        match (0..places.len()).find(|&i| out[(i, i)].is_nan() || out[(i, i)] <= 0.0) {
            Some(index) => Err(self.untestable(parameters[index].0, "a parameter of it has no variance")),
            None => Ok(out),
        }
    }

    fn untestable(&self, block: BlockId, reason: &'static str) -> Error {
        Error::Untestable { what: format!("block `{}`", self.block_label(block)), reason }
    }
}
