//! Many observed values reduced to few that say the same.

use adjust::Jacobians;

/// Rows taken in at once: they fit into the first cache together with R.
const BLOCK: usize = 64;

/// The triangular factor of the rows `[√w J | √w v]` of many observed values, by Householder reflections of one block of
/// rows after the other.
///
/// The factor `[R y; 0 e]` fulfils `RᵀR = JᵀWJ`, `Rᵀy = JᵀWv` and `yᵀy + e² = vᵀWv`: R and `[y; e]` stand for thousands of
/// observed values in a least-squares adjustment without loss, also where parameters are hardly determined.
pub(crate) struct Reduction {
    width: usize,
    /// Upper triangle, row by row.
    factor: Vec<f64>,
    /// Rows not yet taken in, column by column.
    block: Vec<f64>,
    filled: usize,
    /// What a robust objective has beyond the weighted squares.
    excess: f64,
}

impl Reduction {
    /// For rows of `columns` derivatives and a residual.
    pub(crate) fn new(columns: usize) -> Self {
        let width = columns + 1;
        Self { width, factor: vec![0.0; width * width], block: vec![0.0; width * BLOCK], filled: 0, excess: 0.0 }
    }

    /// Adds a row, derivatives and residual divided by the standard deviation. `weight` is its robust weight and
    /// `objective` its share of what is to become least, `weight v²` at least.
    pub(crate) fn add(&mut self, row: &[f64], weight: f64, objective: f64) {
        let root = weight.sqrt();
        for (column, value) in self.block.chunks_exact_mut(BLOCK).zip(row) {
            column[self.filled] = root * value;
        }
        let residual = root * row[self.width - 1];
        self.excess += objective - residual * residual;
        self.filled += 1;
        if self.filled == BLOCK {
            self.take_in();
        }
    }

    /// The rows of R, each followed by its element of y.
    pub(crate) fn rows(&mut self) -> impl Iterator<Item = &[f64]> {
        self.take_in();
        self.factor.chunks_exact(self.width).take(self.width - 1)
    }

    /// Writes `[y; e]`, and R spread over blocks of these sizes; e takes up what is left of the objective.
    pub(crate) fn write(mut self, blocks: &[usize], residual: &mut [f64], jacobians: Option<&mut Jacobians<'_>>) {
        self.take_in();
        let columns = self.width - 1;
        for (row, value) in self.factor.chunks_exact(self.width).zip(residual.iter_mut()) {
            *value = row[columns];
        }
        residual[columns] = residual[columns].hypot(self.excess.max(0.0).sqrt());
        let Some(jacobians) = jacobians else { return };
        for (k, row) in self.factor.chunks_exact(self.width).take(columns).enumerate() {
            let mut rest = row;
            for (block, size) in blocks.iter().enumerate() {
                let (own, others) = rest.split_at(*size);
                jacobians.row(block, k).copy_from_slice(own);
                rest = others;
            }
        }
    }

    /// Reflects the waiting rows into the factor.
    fn take_in(&mut self) {
        let filled = self.filled;
        for k in 0..self.width {
            let (_, from_k) = self.block.split_at_mut(k * BLOCK);
            let (own, others) = from_k.split_at_mut(BLOCK);
            let own = &own[..filled];
            let below: f64 = own.iter().map(|value| value * value).sum();
            if below == 0.0 {
                continue;
            }
            let row = &mut self.factor[k * self.width + k..(k + 1) * self.width];
            let length = row[0].hypot(below.sqrt());
            // Away from the diagonal's own sign, so that nothing cancels.
            let new = if row[0] > 0.0 { -length } else { length };
            let first = row[0] - new;
            let scale = 2.0 / (first * first + below);
            row[0] = new;
            for (element, column) in row[1..].iter_mut().zip(others.chunks_exact_mut(BLOCK)) {
                let column = &mut column[..filled];
                let product: f64 = own.iter().zip(column.iter()).map(|(a, b)| a * b).sum();
                let share = scale * (first * *element + product);
                *element -= share * first;
                column.iter_mut().zip(own).for_each(|(value, own)| *value -= share * own);
            }
        }
        self.filled = 0;
    }
}
