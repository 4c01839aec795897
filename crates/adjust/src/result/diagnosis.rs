use crate::{Combination, Solution};

/// How far the unknowns are from being undetermined.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Diagnosis {
    /// Upper bound of the condition of the whitened Jacobian with columns of unit length: 1e3 is usual in a network,
    /// from 1e5 on some combination of parameters is hardly determined.
    pub condition: f64,
    /// The combination that is known worst.
    pub weakest: Combination,
    /// How many times larger the standard deviation of that combination is than it would be if its parameters did not
    /// share their effect with others.
    pub weakest_inflation: f64,
    /// Pairs of unknowns whose correlation exceeds the limit asked for, strongest first: names and correlation.
    pub correlated: Vec<(String, String, f64)>,
}

/// Unknowns up to which all pairs are searched for correlation.
const EXHAUSTIVE: usize = 2000;

impl Solution {
    /// Examines the solution for near-defects; lists pairs with a correlation of at least `limit` in magnitude. In
    /// networks of more than 2000 unknowns pairs of two different blocks that were eliminated (points) are not searched.
    pub fn diagnosis(&self, limit: f64) -> Diagnosis {
        let variances = self.cofactor.diagonal(&self.layout);
        let (direction, inflation) = self.weakest(&variances);
        let mut correlated = self.correlated(limit, &variances);
        correlated.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        Diagnosis {
            condition: self.cofactor.condition(&self.layout),
            weakest: Combination::new(&direction, &self.names),
            weakest_inflation: inflation,
            correlated,
        }
    }

    fn correlated(&self, limit: f64, variances: &[f64]) -> Vec<(String, String, f64)> {
        let mut out = Vec::new();
        let all = self.unknowns() <= EXHAUSTIVE;
        let apart = |block: usize| !all && self.cofactor.is_eliminated(block);
        for second in 0..self.layout.blocks() {
            for first in second..self.layout.blocks() {
                if first != second && apart(first) && apart(second) {
                    continue;
                }
                let block = self.cofactor.block(&self.layout, first, second);
                for (j, column) in self.layout.free(second).enumerate() {
                    for (i, row) in self.layout.free(first).enumerate().filter(|&(_, row)| row > column) {
                        let correlation = block[(i, j)] / (variances[row] * variances[column]).sqrt();
                        if correlation.abs() >= limit {
                            out.push((self.names[column].clone(), self.names[row].clone(), correlation));
                        }
                    }
                }
            }
        }
        out
    }

    /// Largest eigenvector of the cofactor matrix in scaled unknowns, by power iteration, and the root of its
    /// eigenvalue.
    fn weakest(&self, variances: &[f64]) -> (Vec<f64>, f64) {
        let (n, scale) = (self.unknowns(), self.cofactor.scale());
        // The worst column is a good start: it nearly always contains the weakest direction.
        let variance = |i: usize| variances[i] / (scale[i] * scale[i]);
        let worst = (0..n).max_by(|&a, &b| variance(a).total_cmp(&variance(b))).unwrap_or(0);
        let mut direction: Vec<f64> = (0..n).map(|i| if i == worst { 1.0 } else { 0.0 }).collect();
        let mut eigenvalue = 0.0;
        // The answer is for reading: two digits of the weights, and the number of rounds bounded.
        for _ in 0..100 {
            let unscaled: Vec<f64> = direction.iter().zip(scale).map(|(w, s)| w / s).collect();
            let mut next = self.cofactor.multiply(&unscaled);
            next.iter_mut().zip(scale).for_each(|(w, s)| *w /= s);
            let norm = next.iter().map(|w| w * w).sum::<f64>().sqrt();
            if norm == 0.0 || !norm.is_finite() {
                break;
            }
            direction = next.into_iter().map(|w| w / norm).collect();
            let settled = (norm - eigenvalue).abs() <= 1e-6 * norm;
            eigenvalue = norm;
            if settled {
                break;
            }
        }
        (direction, eigenvalue.sqrt())
    }
}
