//! The Cholesky factor of a block matrix, block column by block column.

use crate::inverse::SelectedInverse;
use crate::matrix::BlockMatrix;
use crate::order::Symbolic;

/// The factor L of `P A Pᵀ = L Lᵀ`, in blocks.
#[derive(Debug, Clone)]
pub struct BlockFactor {
    pub(crate) symbolic: Symbolic,
    /// First row of each block row of the matrix.
    pub(crate) starts: Vec<usize>,
    /// By position: the rows of the diagonal block, then those of the filled blocks below, each of the width of the column.
    pub(crate) panels: Vec<Vec<f64>>,
}

impl BlockFactor {
    pub(crate) fn new(matrix: &BlockMatrix, symbolic: Symbolic) -> Option<Self> {
        let mut panels: Vec<Vec<f64>> =
            (0..symbolic.order.len()).map(|column| filled(matrix, &symbolic, column)).collect();
        for column in 0..panels.len() {
            let mut own = std::mem::take(&mut panels[column]);
            let width = symbolic.widths[column];
            if !factorise(&mut own, width) {
                return None;
            }
            let below = &symbolic.below[column];
            let mut first = width;
            for (k, &target) in below.iter().enumerate() {
                let rows = symbolic.widths[target as usize];
                let target = target as usize;
                subtract(&symbolic, (&own, width), (first, &below[k..]), target, &mut panels[target]);
                first += rows;
            }
            panels[column] = own;
        }
        Some(Self { symbolic, starts: matrix.starts.clone(), panels })
    }

    /// Number of filled blocks.
    pub fn filled(&self) -> usize {
        self.symbolic.below.iter().map(|below| below.len() + 1).sum()
    }

    /// Number of rows.
    pub fn order(&self) -> usize {
        self.starts[self.symbolic.order.len()]
    }

    fn start(&self, position: usize) -> usize {
        self.starts[self.symbolic.order[position]]
    }

    /// Replaces b by the solution of `A x = b`. A slice of another length is left as it is.
    pub fn solve(&self, right: &mut [f64]) {
        if right.len() == self.order() {
            self.forward(right);
            self.backward(right);
        }
    }

    /// `xᵀ A⁻¹ x`: the square of `L⁻¹ P x`. Block columns that x does not reach cost nothing.
    pub fn inverse_square(&self, x: &[f64]) -> f64 {
        if x.len() != self.order() {
            return f64::NAN;
        }
        let mut work = x.to_vec();
        self.forward(&mut work);
        work.iter().map(|value| value * value).sum()
    }

    /// The blocks of the inverse where the factor is filled, those of the matrix and its diagonal among them.
    pub fn selected_inverse(&self) -> SelectedInverse {
        SelectedInverse::new(self)
    }

    fn forward(&self, x: &mut [f64]) {
        for (column, panel) in self.panels.iter().enumerate() {
            let (start, width) = (self.start(column), self.symbolic.widths[column]);
            if x[start..start + width].iter().all(|value| *value == 0.0) {
                continue;
            }
            for i in 0..width {
                let known: f64 = (0..i).map(|j| panel[i * width + j] * x[start + j]).sum();
                x[start + i] = (x[start + i] - known) / panel[i * (width + 1)];
            }
            let own: Vec<f64> = x[start..start + width].to_vec();
            let mut rows = panel.chunks_exact(width.max(1)).skip(width);
            for &other in &self.symbolic.below[column] {
                let (first, count) = (self.start(other as usize), self.symbolic.widths[other as usize]);
                for (value, row) in x[first..first + count].iter_mut().zip(&mut rows) {
                    *value -= row.iter().zip(&own).map(|(l, y)| l * y).sum::<f64>();
                }
            }
        }
    }

    fn backward(&self, x: &mut [f64]) {
        for (column, panel) in self.panels.iter().enumerate().rev() {
            let (start, width) = (self.start(column), self.symbolic.widths[column]);
            let mut own: Vec<f64> = x[start..start + width].to_vec();
            let mut rows = panel.chunks_exact(width.max(1)).skip(width);
            for &other in &self.symbolic.below[column] {
                let (first, count) = (self.start(other as usize), self.symbolic.widths[other as usize]);
                for (value, row) in x[first..first + count].iter().zip(&mut rows) {
                    own.iter_mut().zip(row).for_each(|(y, l)| *y -= l * value);
                }
            }
            for i in (0..width).rev() {
                let known: f64 = (i + 1..width).map(|j| panel[j * width + i] * own[j]).sum();
                own[i] = (own[i] - known) / panel[i * (width + 1)];
            }
            x[start..start + width].copy_from_slice(&own);
        }
    }
}

/// The column of the matrix at a position, with zeros where the factor alone is filled.
fn filled(matrix: &BlockMatrix, symbolic: &Symbolic, column: usize) -> Vec<f64> {
    let (block, width) = (symbolic.order[column], symbolic.widths[column]);
    let mut out = matrix.columns[block].get(&block).cloned().unwrap_or_else(|| vec![0.0; width * width]);
    for &below in &symbolic.below[column] {
        let (other, rows) = (symbolic.order[below as usize], symbolic.widths[below as usize]);
        let first = out.len();
        out.resize(first + rows * width, 0.0);
        match (matrix.columns[block].get(&other), matrix.columns[other].get(&block)) {
            (Some(values), _) if other > block => out[first..].copy_from_slice(values),
            (_, Some(values)) if other < block => {
                for i in 0..rows {
                    for j in 0..width {
                        out[first + i * width + j] = values[j * rows + i];
                    }
                }
            }
            _ => {}
        }
    }
    out
}

/// The factor of the diagonal block, and `X L⁻ᵀ` for the rows below; `false` where a pivot is not positive.
fn factorise(panel: &mut [f64], width: usize) -> bool {
    let (own, below) = panel.split_at_mut(width * width);
    for j in 0..width {
        let known: f64 = (0..j).map(|k| own[j * width + k] * own[j * width + k]).sum();
        let pivot = own[j * width + j] - known;
        if pivot.is_nan() || pivot <= 0.0 || pivot == f64::INFINITY {
            return false;
        }
        let root = pivot.sqrt();
        own[j * width + j] = root;
        for i in j + 1..width {
            let known: f64 = (0..j).map(|k| own[i * width + k] * own[j * width + k]).sum();
            own[i * width + j] = (own[i * width + j] - known) / root;
            own[j * width + i] = 0.0;
        }
    }
    for row in below.chunks_exact_mut(width.max(1)) {
        for j in 0..width {
            let known: f64 = (0..j).map(|k| row[k] * own[j * width + k]).sum();
            row[j] = (row[j] - known) / own[j * width + j];
        }
    }
    true
}

/// Width of the blocks of poses, most blocks of all: their products have loops of a known length.
const POSE: usize = 6;

/// The rows of a block of poses as columns.
fn transposed(block: &[f64]) -> [[f64; POSE]; POSE] {
    let mut out = [[0.0; POSE]; POSE];
    for (j, row) in block.chunks_exact(POSE).enumerate() {
        for (i, value) in row.iter().enumerate() {
            out[i][j] = *value;
        }
    }
    out
}

/// Takes a row times a block from a row. Each sum runs in the order of the plain loop; the sums of a row run side by side.
#[inline]
fn subtract_of_poses(block: &[[f64; POSE]; POSE], row: &[f64], out: &mut [f64]) {
    let mut sums = [0.0; POSE];
    for (left, right) in row.iter().zip(block) {
        for (sum, right) in sums.iter_mut().zip(right) {
            *sum += left * right;
        }
    }
    out.iter_mut().zip(sums).for_each(|(out, sum)| *out -= sum);
}

/// Takes the products of the rows of a factorised column from a later column. `rest` are the column's filled block rows from that
/// of the target on, the first of which begins at row `first` of the panel.
fn subtract(
    symbolic: &Symbolic,
    (own, width): (&[f64], usize),
    (first, rest): (usize, &[u32]),
    target: usize,
    out: &mut [f64],
) {
    let columns = symbolic.widths[target];
    let factor = &own[first * width..(first + columns) * width];
    let poses = (width == POSE && columns == POSE).then(|| transposed(factor));
    let mut row = first;
    // Where the filled rows of the target begin; all of `rest` are among them.
    let (mut place, mut below) = (columns, symbolic.below[target].iter());
    for (k, &other) in rest.iter().enumerate() {
        let rows = symbolic.widths[other as usize];
        let begin = if k == 0 {
            0
        } else {
            for &filled in below.by_ref() {
                if filled == other {
                    break;
                }
                place += symbolic.widths[filled as usize];
            }
            place += rows;
            place - rows
        };
        let left = own[row * width..(row + rows) * width].chunks_exact(width.max(1));
        let sums = out[begin * columns..(begin + rows) * columns].chunks_exact_mut(columns.max(1));
        if let Some(factor) = &poses {
            left.zip(sums).for_each(|(left, sums)| subtract_of_poses(factor, left, sums));
        } else {
            for (left, sums) in left.zip(sums) {
                for (sum, right) in sums.iter_mut().zip(factor.chunks_exact(width.max(1))) {
                    *sum -= left.iter().zip(right).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        row += rows;
    }
}
