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

impl Solution {
    /// Examines the solution for near-defects; lists pairs with a correlation of at least `limit` in magnitude.
    pub fn diagnosis(&self, limit: f64) -> Diagnosis {
        let (direction, inflation) = self.weakest();
        let mut correlated = Vec::new();
        for column in 0..self.unknowns() {
            for row in column + 1..self.unknowns() {
                let correlation = self.correlation_of(row, column);
                if correlation.abs() >= limit {
                    correlated.push((self.names[column].clone(), self.names[row].clone(), correlation));
                }
            }
        }
        correlated.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
        Diagnosis {
            condition: self.condition,
            weakest: Combination::new(&direction, &self.names),
            weakest_inflation: inflation,
            correlated,
        }
    }

    /// Largest eigenvector of the cofactor matrix in scaled unknowns, by power iteration, and the root of its
    /// eigenvalue.
    fn weakest(&self) -> (Vec<f64>, f64) {
        let n = self.unknowns();
        // The worst column is a good start: it nearly always contains the weakest direction.
        let variance = |i: usize| self.cofactor(i, i) / (self.scale[i] * self.scale[i]);
        let worst = (0..n).max_by(|&a, &b| variance(a).total_cmp(&variance(b))).unwrap_or(0);
        let mut direction: Vec<f64> = (0..n).map(|i| if i == worst { 1.0 } else { 0.0 }).collect();
        let mut eigenvalue = 0.0;
        // The answer is for reading: two digits of the weights, and the number of rounds bounded.
        for _ in 0..100 {
            let scaled: Vec<f64> = direction.iter().zip(&self.scale).map(|(w, s)| w / s).collect();
            let columns = self.cofactor.chunks_exact(n.max(1)).zip(&self.scale);
            let next: Vec<f64> =
                columns.map(|(q, s)| q.iter().zip(&scaled).map(|(q, w)| q * w).sum::<f64>() / s).collect();
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
