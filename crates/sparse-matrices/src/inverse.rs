//! The blocks of the inverse where the factor is filled \[Takahashi1973\].

use std::sync::OnceLock;

use nalgebra::DMatrix;

use crate::factor::BlockFactor;

/// An inverse of which each block is computed when it is asked for: the selected ones together, others by solving for them.
#[derive(Debug, Clone)]
pub struct BlockInverse {
    factor: BlockFactor,
    selected: OnceLock<SelectedInverse>,
}

impl BlockInverse {
    /// Of the matrix that was factorised.
    pub fn new(factor: BlockFactor) -> Self {
        Self { factor, selected: OnceLock::new() }
    }

    /// The factor.
    pub fn factor(&self) -> &BlockFactor {
        &self.factor
    }

    /// The product with a vector: the solution of `A x = b`.
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut out = right.to_vec();
        self.factor.solve(&mut out);
        out
    }

    /// The block of two block rows where the factor is filled; `None` elsewhere.
    pub fn selected(&self, row: usize, column: usize) -> Option<DMatrix<f64>> {
        self.selected.get_or_init(|| self.factor.selected_inverse()).block(row, column)
    }

    /// The block of two block rows, which must be there.
    pub fn block(&self, row: usize, column: usize) -> DMatrix<f64> {
        self.selected(row, column).unwrap_or_else(|| {
            let starts = &self.factor.starts;
            let width = |block: usize| starts[block + 1] - starts[block];
            let mut out = DMatrix::zeros(width(row), width(column));
            for k in 0..width(column) {
                let solved = self.column(starts[column] + k);
                out.column_mut(k).copy_from_slice(&solved[starts[row]..starts[row + 1]]);
            }
            out
        })
    }

    /// A whole column.
    pub fn column(&self, column: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.factor.order()];
        out[column] = 1.0;
        self.factor.solve(&mut out);
        out
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        (0..self.factor.starts.len() - 1)
            .flat_map(|block| self.block(block, block).diagonal().as_slice().to_vec())
            .collect()
    }
}

/// The blocks of an inverse where the factor is filled.
#[derive(Debug, Clone)]
pub struct SelectedInverse {
    position: Vec<usize>,
    widths: Vec<usize>,
    below: Vec<Vec<u32>>,
    /// First row of each filled block in the panel of its column; the diagonal block comes before.
    firsts: Vec<Vec<usize>>,
    panels: Vec<Vec<f64>>,
}

impl SelectedInverse {
    /// With `Z = A⁻¹` and `Y = L_below L⁻¹` of a column: `Z_below = −Z Y`, and on the diagonal `L⁻ᵀ L⁻¹ − Yᵀ Z_below`. The
    /// elements of Z that are needed lie where later columns are filled.
    pub(crate) fn new(factor: &BlockFactor) -> Self {
        let symbolic = &factor.symbolic;
        let mut this = Self {
            position: symbolic.position.clone(),
            widths: symbolic.widths.clone(),
            below: symbolic.below.clone(),
            firsts: Vec::with_capacity(symbolic.order.len()),
            panels: factor.panels.clone(),
        };
        for (below, width) in this.below.iter().zip(&this.widths) {
            let begin = |first: &mut usize, other: &u32| {
                let own = *first;
                *first += symbolic.widths[*other as usize];
                Some(own)
            };
            this.firsts.push(below.iter().scan(*width, begin).collect());
        }
        for column in (0..this.panels.len()).rev() {
            let own = std::mem::take(&mut this.panels[column]);
            this.panels[column] = this.column(column, own);
        }
        this
    }

    fn column(&self, column: usize, mut own: Vec<f64>) -> Vec<f64> {
        let width = self.widths[column];
        let inverse = inverse_of_lower(&own[..width * width], width);
        // Y in place of L below the diagonal.
        for row in own[width * width..].chunks_exact_mut(width.max(1)) {
            let product: Vec<f64> =
                (0..width).map(|j| (j..width).map(|k| row[k] * inverse[k * width + j]).sum()).collect();
            row.copy_from_slice(&product);
        }
        let (below, firsts) = (&self.below[column], &self.firsts[column]);
        let mut out = vec![0.0; own.len()];
        for (k, &inner) in below.iter().enumerate() {
            self.add_products(inner as usize, (&below[k..], &firsts[k..]), (&own, width), &mut out);
        }
        for i in 0..width {
            for j in 0..width {
                let mut sum: f64 = (i.max(j)..width).map(|k| inverse[k * width + i] * inverse[k * width + j]).sum();
                for row in width..own.len() / width.max(1) {
                    sum -= own[row * width + i] * out[row * width + j];
                }
                out[i * width + j] = sum;
            }
        }
        out
    }

    /// Subtracts what one filled block row of a column, the first of these, and those after it contribute to `Z Y`.
    fn add_products(
        &self,
        inner: usize,
        (rest, firsts): (&[u32], &[usize]),
        (y, width): (&[f64], usize),
        out: &mut [f64],
    ) {
        let columns = self.widths[inner];
        let panel = &self.panels[inner];
        let mut filled = self.below[inner].iter().zip(&self.firsts[inner]);
        for (k, (&outer, &first)) in rest.iter().zip(firsts).enumerate() {
            let begin =
                if k == 0 { 0 } else { filled.find(|(other, _)| **other == outer).map_or(0, |(_, begin)| *begin) };
            let rows = self.widths[outer as usize];
            if width == 6 {
                let z = &panel[begin * columns..(begin + rows) * columns];
                add_of_poses(z, columns, (first, firsts[0]), y, out, k > 0);
                continue;
            }
            for i in 0..rows {
                let z = &panel[(begin + i) * columns..(begin + i + 1) * columns];
                for (j, z) in z.iter().enumerate() {
                    let (a, b) = ((first + i) * width, (firsts[0] + j) * width);
                    for c in 0..width {
                        out[a + c] -= z * y[b + c];
                        if k > 0 {
                            out[b + c] -= z * y[a + c];
                        }
                    }
                }
            }
        }
    }

    /// The block of two block rows of the matrix; `None` where the factor is not filled.
    pub fn block(&self, row: usize, column: usize) -> Option<DMatrix<f64>> {
        let (a, b) = (*self.position.get(row)?, *self.position.get(column)?);
        let (low, high) = (a.min(b), a.max(b));
        let (rows, columns) = (self.widths[high], self.widths[low]);
        let first =
            if low == high { 0 } else { self.firsts[low][self.below[low].binary_search(&(high as u32)).ok()?] };
        let block =
            DMatrix::from_row_slice(rows, columns, &self.panels[low][first * columns..(first + rows) * columns]);
        Some(if a >= b { block } else { block.transpose() })
    }
}

/// The products of a block of the inverse with Y of a column of poses: loops of a known length.
fn add_of_poses(z: &[f64], columns: usize, (outer, inner): (usize, usize), y: &[f64], out: &mut [f64], is_below: bool) {
    for (i, z) in z.chunks_exact(columns.max(1)).enumerate() {
        for (j, z) in z.iter().enumerate() {
            let (a, b) = ((outer + i) * 6, (inner + j) * 6);
            for (out, y) in out[a..a + 6].iter_mut().zip(&y[b..b + 6]) {
                *out -= z * y;
            }
            if is_below {
                for (out, y) in out[b..b + 6].iter_mut().zip(&y[a..a + 6]) {
                    *out -= z * y;
                }
            }
        }
    }
}

/// The inverse of a lower triangle, row by row.
fn inverse_of_lower(lower: &[f64], n: usize) -> Vec<f64> {
    let mut out = vec![0.0; n * n];
    for row in 0..n {
        for column in 0..=row {
            let known: f64 = (column..row).map(|k| lower[row * n + k] * out[k * n + column]).sum();
            let one = if row == column { 1.0 } else { 0.0 };
            out[row * n + column] = (one - known) / lower[row * n + row];
        }
    }
    out
}
