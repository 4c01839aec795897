use std::fmt;

use nalgebra::DMatrix;

use crate::{BlockId, Combination, Error, Result, Scale, Solution};

/// Unknowns that are examined together.
const LARGEST: usize = 3000;
/// Parameters with at least this share of the leading one's weight are counted among the leading.
const LEADING: f64 = 0.3;
/// So many leading parameters are compared with each other.
const COMPARED: usize = 4;

/// What is looked for in [`Solution::near_defects`].
#[derive(Debug, Clone, PartialEq)]
pub struct WeaknessOptions {
    /// Blocks examined, the calibration and the stations for example; `None`, the default: all. What the others leave
    /// undetermined counts: the covariances are those of the whole adjustment.
    pub blocks: Option<Vec<BlockId>>,
    /// A combination of parameters is reported when it is known so many times worse than it would be if its parameters
    /// did not share their effect with others. 10 is a pair of parameters with a correlation of 0.99. Default: 10.
    pub inflation: f64,
    /// Most combinations reported. Default: 10.
    pub max_count: usize,
}

impl Default for WeaknessOptions {
    fn default() -> Self {
        Self { blocks: None, inflation: 10.0, max_count: 10 }
    }
}

/// A combination of parameters that the observations hardly determine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NearDefect {
    /// The combination: how the parameters may change together with hardly any effect.
    pub combination: Combination,
    /// How many times worse it is known than it would be if its parameters did not share their effect with others.
    pub inflation: f64,
    /// The parameter with the largest weight: block, component and name.
    pub leading: (BlockId, usize, String),
    /// Prior standard deviation of the leading parameter that comes from this combination, unit of the parameter.
    pub deviation: f64,
    /// Prior standard deviation of the leading parameter in all, and what it would be if all other unknowns were known.
    pub leading_deviations: (f64, f64),
    /// Correlations among the leading parameters: names and correlation, strongest first.
    pub correlations: Vec<(String, String, f64)>,
    /// The linear function of all examined parameters whose prior standard deviation is the inflation: block, component
    /// and weight, in one over the parameter's unit.
    pub functional: Vec<(BlockId, usize, f64)>,
}

/// The hardly determined combinations of a solution.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct NearDefects {
    /// Weakest first; empty where all is determined well.
    pub combinations: Vec<NearDefect>,
    /// How many exceed the limit, reported or not.
    pub count: usize,
    /// Largest inflation, whether it exceeds the limit or not; 1 where there are no unknowns.
    pub largest_inflation: f64,
}

impl NearDefect {
    /// What would help, in a sentence.
    pub fn advice(&self) -> String {
        let names: Vec<&str> = self.combination.terms.iter().take(COMPARED).map(|(name, _)| name.as_str()).collect();
        match names.as_slice() {
            [] => String::new(),
            [one] => format!("hold or weight {one}, or add observations that depend on it"),
            [first, others @ ..] => format!(
                "hold or weight {first} (or {}), or add observations in which they act differently",
                others.join(", ")
            ),
        }
    }
}

impl fmt::Display for NearDefect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} is known {:.1} times worse than its parameters would be alone (standard deviation {:.3e} in {})",
            self.combination, self.inflation, self.deviation, self.leading.2
        )?;
        if let Some((first, second, correlation)) = self.correlations.first() {
            write!(f, "; correlation of {first} and {second} {correlation:.4}")?;
        }
        write!(f, ": {}", self.advice())
    }
}

impl Solution {
    /// Names the combinations of parameters that are hardly determined, weakest first: the eigenvectors of the cofactor
    /// matrix of the chosen blocks, each parameter measured in the standard deviation that it would have if all other
    /// unknowns were known. Their inflation is the root of the eigenvalue.
    ///
    /// # Errors
    /// A block is unknown or named twice; [`Error::TooLarge`] beyond 3000 parameters: choose blocks;
    /// [`Error::Option`] for options outside their domain.
    pub fn near_defects(&self, options: &WeaknessOptions) -> Result<NearDefects> {
        if options.inflation.is_nan() || options.inflation < 1.0 {
            let (name, value) = ("inflation", options.inflation);
            return Err(Error::Option { name, value, expected: "a number of at least 1" });
        }
        let all = || (0..self.blocks.len()).map(BlockId::new).collect();
        let blocks = options.blocks.clone().unwrap_or_else(all);
        let subset = Subset::new(self, &blocks)?;
        let n = subset.names.len();
        let scaled = DMatrix::from_fn(n, n, |i, j| subset.covariance[(i, j)] / (subset.alone[i] * subset.alone[j]));
        let (values, vectors) = dense_matrices::symmetric_eigen(scaled.as_slice(), n)?;
        let inflation = |index: usize| values[index].max(0.0).sqrt();
        let weak: Vec<usize> = (0..n).rev().take_while(|&index| inflation(index) >= options.inflation).collect();
        let describe = |&index: &usize| subset.describe(&vectors[index * n..(index + 1) * n], inflation(index));
        Ok(NearDefects {
            combinations: weak.iter().take(options.max_count).map(describe).collect(),
            count: weak.len(),
            largest_inflation: if n == 0 { 1.0 } else { inflation(n - 1) },
        })
    }

    /// Prior standard deviations that the unknowns would have if all others were known, `1/√Nᵢᵢ`, in the order of
    /// [`Self::unknown_names`]; infinite without observations.
    fn deviations_alone(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.unknowns()];
        for place in &self.layout.observations {
            let columns = self.columns_of(place);
            let rows = self.linearisation.jacobian[place.jacobian_range()].chunks_exact(columns.len().max(1));
            for (entries, row) in rows.zip(place.rows()) {
                for (a, &column) in entries.iter().zip(&columns) {
                    diagonal[column] += self.weights()[row] * a * a;
                }
            }
        }
        diagonal.into_iter().map(|n: f64| 1.0 / n.sqrt()).collect()
    }
}

/// The free parameters of some blocks.
struct Subset {
    owners: Vec<(BlockId, usize)>,
    names: Vec<String>,
    covariance: DMatrix<f64>,
    alone: Vec<f64>,
}

impl Subset {
    fn new(solution: &Solution, blocks: &[BlockId]) -> Result<Self> {
        let offsets = solution.offsets(blocks)?;
        let unknowns = offsets[blocks.len()];
        if unknowns > LARGEST {
            return Err(Error::TooLarge { unknowns, limit: LARGEST });
        }
        let joint = solution.covariance_of(blocks, Scale::Prior)?;
        let all_alone = solution.deviations_alone();
        let (mut owners, mut places, mut alone) = (Vec::new(), Vec::new(), Vec::new());
        for (index, &block) in blocks.iter().enumerate() {
            for component in 0..offsets[index + 1] - offsets[index] {
                // Parameters that only constraints determine share no effect of observations.
                let column = solution.unknown_index(block, component)?;
                if let Some(column) = column.filter(|&column| all_alone[column].is_finite()) {
                    owners.push((block, component));
                    places.push(offsets[index] + component);
                    alone.push(all_alone[column]);
                }
            }
        }
        let names = owners.iter().map(|&owner| solution.parameter_name(owner)).collect();
        let n = places.len();
        let covariance = DMatrix::from_fn(n, n, |row, column| joint[(places[row], places[column])]);
        Ok(Self { owners, names, covariance, alone })
    }

    fn describe(&self, direction: &[f64], inflation: f64) -> NearDefect {
        let mut order: Vec<usize> = (0..direction.len()).collect();
        order.sort_by(|&a, &b| direction[b].abs().total_cmp(&direction[a].abs()));
        let first = order.first().copied().unwrap_or(0);
        let least = LEADING * direction[first].abs();
        let leading: Vec<usize> =
            order.iter().copied().take(COMPARED).filter(|&index| direction[index].abs() >= least).collect();
        let mut correlations = Vec::new();
        for (place, &row) in leading.iter().enumerate() {
            for &column in &leading[..place] {
                let variances = self.covariance[(row, row)] * self.covariance[(column, column)];
                let correlation = self.covariance[(row, column)] / variances.sqrt();
                correlations.push((self.names[column].clone(), self.names[row].clone(), correlation));
            }
        }
        correlations.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        let (block, component) = self.owners[first];
        NearDefect {
            combination: Combination::new(direction, &self.names),
            inflation,
            leading: (block, component, self.names[first].clone()),
            deviation: inflation * direction[first].abs() * self.alone[first],
            leading_deviations: (self.covariance[(first, first)].max(0.0).sqrt(), self.alone[first]),
            correlations,
            functional: self
                .owners
                .iter()
                .zip(direction.iter().zip(&self.alone))
                .map(|(&(block, component), (weight, alone))| (block, component, weight / alone))
                .collect(),
        }
    }
}
