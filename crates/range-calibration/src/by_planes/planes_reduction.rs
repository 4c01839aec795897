//! Many observed values reduced to few that say the same.

use adjust::Jacobians;

/// Rows multiplied at once: they fit into the first cache.
const BLOCK: usize = 64;

/// Products summed side by side, so that they go through the processor's vectors.
const LANES: usize = 8;

/// Square of the share of a column that others leave of it, below which it is rounding. A combination seen so badly by
/// all captures would have deviations a million times larger than alone, far beyond what is accepted as determined.
const ROUNDING: f64 = 1e-13;

/// The normal equations `AᵀA` of the rows `A = [√w J | √w v]` of many observed values, summed block by block.
pub(crate) struct NormalEquations {
    width: usize,
    /// Upper triangle, row by row.
    products: Vec<f64>,
    /// Rows not yet multiplied, column by column.
    block: Vec<f64>,
    filled: usize,
    /// What is to become least: weighted squares, or what a robust weight stands for.
    objective: f64,
}

impl NormalEquations {
    /// For rows of `columns` derivatives and a residual.
    pub(crate) fn new(columns: usize) -> Self {
        let width = columns + 1;
        let (products, block) = (vec![0.0; width * width], vec![0.0; width * BLOCK]);
        Self { width, products, block, filled: 0, objective: 0.0 }
    }

    /// Adds a row, to be multiplied with `root`. `objective` is its share of what is to become least, the square of
    /// `root · residual` at least.
    pub(crate) fn add(&mut self, derivatives: impl Iterator<Item = f64>, residual: f64, root: f64, objective: f64) {
        let (block, mut place) = (&mut self.block, self.filled);
        derivatives.chain([residual]).for_each(|value| {
            if let Some(out) = block.get_mut(place) {
                *out = root * value;
            }
            place += BLOCK;
        });
        self.objective += objective;
        self.filled += 1;
        if self.filled == BLOCK {
            self.multiply();
        }
    }

    /// Adds those of other rows of the same columns.
    pub(crate) fn add_all(&mut self, mut others: Self) {
        others.multiply();
        self.products.iter_mut().zip(&others.products).for_each(|(sum, product)| *sum += product);
        self.objective += others.objective;
    }

    /// Adds the products of the waiting rows.
    fn multiply(&mut self) {
        let (width, filled) = (self.width, self.filled);
        if filled < BLOCK {
            self.block.chunks_exact_mut(BLOCK).for_each(|column| column[filled..].fill(0.0));
        }
        for (i, first) in self.block.chunks_exact(BLOCK).enumerate() {
            let sums = &mut self.products[i * width + i..(i + 1) * width];
            for (sum, second) in sums.iter_mut().zip(self.block[i * BLOCK..].chunks_exact(BLOCK)) {
                *sum += product(first, second);
            }
        }
        self.filled = 0;
    }

    /// A square root of the normal equations: Cholesky's with the largest pivot first, columns scaled to one, that ends
    /// where rounding begins. One capture alone hardly ever determines all unknowns.
    pub(crate) fn reduce(mut self) -> Reduction {
        self.multiply();
        let (width, columns) = (self.width, self.width - 1);
        let scale: Vec<f64> = (0..columns).map(|i| self.products[i * width + i].sqrt()).chain([1.0]).collect();
        let mut rest = self.symmetric(&scale);
        let mut rows = vec![0.0; columns * width];
        let mut free: Vec<usize> = (0..columns).collect();
        let mut objective = self.objective;
        for row in rows.chunks_exact_mut(width) {
            let largest = free.iter().enumerate().max_by(|a, b| {
                let pivot = |i: usize| rest[i * width + i];
                pivot(*a.1).total_cmp(&pivot(*b.1))
            });
            let Some((position, &pivot)) = largest.filter(|(_, i)| rest[**i * width + **i] > ROUNDING) else { break };
            free.swap_remove(position);
            let length = rest[pivot * width + pivot].sqrt();
            let left = || free.iter().copied().chain([columns]);
            row[pivot] = length;
            left().for_each(|j| row[j] = rest[pivot * width + j] / length);
            for i in left() {
                left().for_each(|j| rest[i * width + j] -= row[i] * row[j]);
            }
            objective -= row[columns] * row[columns];
            row.iter_mut().zip(&scale).for_each(|(value, scale)| *value *= scale);
        }
        // NaN stays what it is, for the adjustment to find.
        let left_over = if objective < 0.0 { 0.0 } else { objective.sqrt() };
        Reduction { width, rows, left_over }
    }

    /// Both triangles, rows and columns divided by `scale`; columns of zeros stay such.
    fn symmetric(&self, scale: &[f64]) -> Vec<f64> {
        let width = self.width;
        let scaled = |i: usize, j: usize| {
            let (low, high) = (i.min(j), i.max(j));
            let product = self.products[low * width + high];
            if product == 0.0 { 0.0 } else { product / scale[i] / scale[j] }
        };
        (0..width * width).map(|place| scaled(place / width, place % width)).collect()
    }
}

/// The sum of products of two columns, always in the same order.
fn product(first: &[f64], second: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    for (a, b) in first.chunks_exact(LANES).zip(second.chunks_exact(LANES)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().sum()
}

/// Rows `[R y]` and a number e with `RᵀR = JᵀWJ`, `Rᵀy = JᵀWv` and `yᵀy + e²` the objective: as good as thousands of
/// observed values in a least-squares adjustment.
pub(crate) struct Reduction {
    width: usize,
    rows: Vec<f64>,
    left_over: f64,
}

impl Reduction {
    /// The rows of R, each followed by its element of y.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(self.width)
    }

    /// Writes `[y; e]`, and R spread over blocks of these sizes.
    pub(crate) fn write(&self, blocks: &[usize], residual: &mut [f64], jacobians: Option<&mut Jacobians<'_>>) {
        let columns = self.width - 1;
        self.rows().zip(residual.iter_mut()).for_each(|(row, value)| *value = row[columns]);
        residual[columns] = self.left_over;
        let Some(jacobians) = jacobians else { return };
        for (k, row) in self.rows().enumerate() {
            let mut rest = row;
            for (block, size) in blocks.iter().enumerate() {
                let (own, others) = rest.split_at(*size);
                jacobians.row(block, k).copy_from_slice(own);
                rest = others;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Rows of five derivatives, the last the sum of the first two, and residuals.
    fn rows(count: usize) -> (DMatrix<f64>, DVector<f64>) {
        let wave = |i: usize, j: usize| (1.0 + i as f64 * (0.37 + j as f64)).sin() * 10.0_f64.powi(3 * j as i32 - 6);
        let jacobian =
            DMatrix::from_fn(count, 5, |i, j| if j < 4 { wave(i, j) } else { wave(i, 0) * 1e3 + wave(i, 1) });
        (jacobian, DVector::from_fn(count, |i, _| 3.0 + (i as f64 * 0.7).cos()))
    }

    #[test]
    fn the_reduction_says_the_same_as_the_rows_also_where_columns_depend() {
        for count in [1, 3, 64, 200] {
            let (jacobian, residual) = rows(count);
            let (mut first, mut second) = (NormalEquations::new(5), NormalEquations::new(5));
            for (i, row) in jacobian.row_iter().enumerate() {
                let half = if i < count / 3 { &mut first } else { &mut second };
                half.add(row.iter().copied(), residual[i], 2.0, 4.0 * residual[i] * residual[i] + 0.5);
            }
            first.add_all(second);
            let reduction = first.reduce();
            let factor = DMatrix::from_row_iterator(5, 6, reduction.rows().flatten().copied());
            let (found, expected) = (factor.columns(0, 5), jacobian * 2.0);
            let (y, v) = (factor.column(5), residual * 2.0);
            let (normal, right) = (expected.transpose() * &expected, expected.transpose() * &v);
            let miss = found.transpose() * found - &normal;
            for i in 0..5 {
                // Cut off below 1e-13 of each column; its share of the right-hand side is the root of that.
                for j in 0..5 {
                    let size = (normal[(i, i)] * normal[(j, j)]).sqrt();
                    assert!(miss[(i, j)].abs() < 3e-13 * size, "{miss}");
                }
                let size = normal[(i, i)].sqrt() * v.norm();
                assert!(((found.transpose() * y)[i] - right[i]).abs() < 1e-6 * size);
            }
            let objective = v.norm_squared() + 0.5 * count as f64;
            let sum = y.norm_squared() + reduction.left_over.powi(2);
            assert!((sum / objective - 1.0).abs() < 1e-12, "{sum} {objective}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_not_hidden() {
        let mut normal = NormalEquations::new(1);
        normal.add([1.0].into_iter(), f64::NAN, 1.0, f64::NAN);
        let reduction = normal.reduce();
        assert!(reduction.left_over.is_nan());
    }
}
