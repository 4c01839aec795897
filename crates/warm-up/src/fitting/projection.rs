//! What is left of columns beside a linear model.

/// Share of a column below which nothing of it is left but rounding.
const ROUNDING: f64 = 1e-7;

/// An orthonormal basis of the columns of a linear model.
#[derive(Debug, Clone, Default)]
pub(crate) struct Basis {
    columns: Vec<Vec<f64>>,
}

impl Basis {
    pub(crate) fn of(columns: impl IntoIterator<Item = Vec<f64>>) -> Self {
        let mut basis = Self::default();
        for column in columns {
            basis.columns.extend(basis.direction(column));
        }
        basis
    }

    pub(crate) fn rank(&self) -> usize {
        self.columns.len()
    }

    /// By how much each of `count` values pulls the model to itself, 0 to 1.
    pub(crate) fn leverages(&self, count: usize) -> Vec<f64> {
        (0..count).map(|index| self.columns.iter().map(|column| column[index].powi(2)).sum()).collect()
    }

    /// The part of a vector that the model does not explain.
    pub(crate) fn residual(&self, mut vector: Vec<f64>) -> Vec<f64> {
        // Twice is enough for orthogonality to rounding.
        for _ in 0..2 {
            for column in &self.columns {
                let share = dot(column, &vector);
                vector.iter_mut().zip(column).for_each(|(out, value)| *out -= share * value);
            }
        }
        vector
    }

    /// The unit vector of that part; `None` where nothing is left.
    pub(crate) fn direction(&self, column: Vec<f64>) -> Option<Vec<f64>> {
        let before = dot(&column, &column);
        let left = self.residual(column);
        let square = dot(&left, &left);
        if square.is_nan() || square <= ROUNDING * ROUNDING * before {
            return None;
        }
        let norm = square.sqrt();
        Some(left.into_iter().map(|value| value / norm).collect())
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
