//! Many equal-ranking observations reduced to few that say the same.

use adjust::Jacobians;

/// Sums of products of the rows `[√w J | √w v]` of many observed values.
///
/// Its Cholesky factor `[R y; 0 e]` is what a QR decomposition of all rows would leave: `RᵀR = JᵀWJ`, `Rᵀy = JᵀWv` and
/// `yᵀy + e² = vᵀWv`, so R and `[y; e]` stand for thousands of observed values in the normal equations without loss.
pub(crate) struct Gram {
    width: usize,
    /// Lower triangle, row by row in full rows.
    sums: Vec<f64>,
    objective: f64,
}

/// Pivots below this share of their diagonal are rounding: the column depends on those before it.
const DEPENDENT: f64 = 1e-13;

impl Gram {
    /// Sums for rows of `columns` derivatives and a residual.
    pub(crate) fn new(columns: usize) -> Self {
        let width = columns + 1;
        Self { width, sums: vec![0.0; width * width], objective: 0.0 }
    }

    /// Adds a row, both parts divided by the standard deviation; `weight` is its robust weight and `objective` its share
    /// of what is to become least, `weight v²` at least.
    pub(crate) fn add(&mut self, row: &[f64], weight: f64, objective: f64) {
        for (i, sums) in self.sums.chunks_exact_mut(self.width).enumerate() {
            let factor = weight * row[i];
            for (sum, value) in sums.iter_mut().zip(&row[..=i]) {
                *sum += factor * value;
            }
        }
        self.objective += objective;
    }

    /// Writes `[y; e]`, and R spread over blocks of these sizes; e takes up what is left of the objective. Derivatives are
    /// those of the model, as are the rows.
    pub(crate) fn reduce(mut self, blocks: &[usize], residual: &mut [f64], jacobians: Option<&mut Jacobians<'_>>) {
        self.factorise();
        let columns = self.width - 1;
        let lower = |row: usize, column: usize| self.sums[row * self.width + column];
        for (k, value) in residual[..columns].iter_mut().enumerate() {
            *value = lower(columns, k);
        }
        let explained: f64 = residual[..columns].iter().map(|y| y * y).sum();
        residual[columns] = (self.objective - explained).max(0.0).sqrt();
        let Some(jacobians) = jacobians else { return };
        for k in 0..columns {
            let mut first = 0;
            for (block, size) in blocks.iter().enumerate() {
                let places = jacobians.row(block, k).iter_mut().zip(first..first + size);
                places.for_each(|(place, column)| *place = if column < k { 0.0 } else { lower(column, k) });
                first += size;
            }
        }
    }

    /// Cholesky factor in place, columns that depend on earlier ones left out.
    fn factorise(&mut self) {
        let width = self.width;
        for k in 0..width {
            let (above, rest) = self.sums.split_at_mut(k * width);
            let done: f64 = rest[..k].iter().map(|value| value * value).sum();
            let pivot = rest[k] - done;
            let root = if pivot > DEPENDENT * rest[k] { pivot.sqrt() } else { 0.0 };
            let _ = above;
            let own: Vec<f64> = rest[..k].to_vec();
            rest[k] = root;
            for row in rest.chunks_exact_mut(width).skip(1) {
                let product: f64 = own.iter().zip(&row[..k]).map(|(a, b)| a * b).sum();
                row[k] = if root > 0.0 { (row[k] - product) / root } else { 0.0 };
            }
        }
    }
}
