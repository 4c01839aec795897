//! A symmetric matrix of which few blocks are filled.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::factor::BlockFactor;
use crate::order::Symbolic;

/// A symmetric matrix in blocks: only those that something was added to are kept, of the lower triangle.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockMatrix {
    /// First row of each block row, and at the end their number.
    pub(crate) starts: Vec<usize>,
    /// By block column: the block rows at or below the diagonal, each row by row.
    pub(crate) columns: Vec<BTreeMap<usize, Vec<f64>>>,
}

impl BlockMatrix {
    /// A matrix of zeros whose block rows have these widths. Blocks on the diagonal are always kept.
    pub fn new(widths: &[usize]) -> Self {
        let mut starts = vec![0];
        starts.extend(widths.iter().scan(0, |sum, width| {
            *sum += width;
            Some(*sum)
        }));
        let own = |(block, width): (usize, &usize)| BTreeMap::from([(block, vec![0.0; width * width])]);
        Self { starts, columns: widths.iter().enumerate().map(own).collect() }
    }

    /// Number of block rows.
    pub fn blocks(&self) -> usize {
        self.columns.len()
    }

    /// Number of rows.
    pub fn order(&self) -> usize {
        self.starts[self.columns.len()]
    }

    /// Number of rows of a block row.
    pub fn width(&self, block: usize) -> usize {
        self.starts[block + 1] - self.starts[block]
    }

    /// First row of a block row.
    pub fn start(&self, block: usize) -> usize {
        self.starts[block]
    }

    /// Number of blocks that are kept, of the lower triangle.
    pub fn filled(&self) -> usize {
        self.columns.iter().map(BTreeMap::len).sum()
    }

    /// Sets all elements to zero; the blocks stay.
    pub fn clear(&mut self) {
        self.columns.iter_mut().flat_map(BTreeMap::values_mut).for_each(|block| block.fill(0.0));
    }

    /// Adds `value(i, j)` to the elements of the block of two block rows, and to its transpose on the other side of the diagonal.
    /// Of a block on the diagonal all elements are added, which should be symmetric.
    pub fn add(&mut self, row: usize, column: usize, value: impl Fn(usize, usize) -> f64) {
        let (rows, columns) = (self.width(row), self.width(column));
        if rows == 0 || columns == 0 {
            return;
        }
        if row >= column {
            let block = self.columns[column].entry(row).or_insert_with(|| vec![0.0; rows * columns]);
            for (i, own) in block.chunks_exact_mut(columns.max(1)).enumerate() {
                own.iter_mut().enumerate().for_each(|(j, sum)| *sum += value(i, j));
            }
        } else {
            let block = self.columns[row].entry(column).or_insert_with(|| vec![0.0; rows * columns]);
            for (j, own) in block.chunks_exact_mut(rows.max(1)).enumerate() {
                own.iter_mut().enumerate().for_each(|(i, sum)| *sum += value(i, j));
            }
        }
    }

    /// Adds to one element of the diagonal.
    pub fn add_to_diagonal(&mut self, row: usize, value: f64) {
        let block = self.starts.partition_point(|&start| start <= row) - 1;
        let (at, width) = (row - self.starts[block], self.width(block));
        if let Some(own) = self.columns[block].get_mut(&block) {
            own[at * (width + 1)] += value;
        }
    }

    /// The diagonal.
    pub fn diagonal(&self) -> Vec<f64> {
        let own = |block: usize| {
            let width = self.width(block);
            let values = self.columns[block].get(&block);
            (0..width).map(move |k| values.map_or(0.0, |values| values[k * (width + 1)]))
        };
        (0..self.blocks()).flat_map(own).collect()
    }

    /// The block of two block rows; zero where nothing was added.
    pub fn block(&self, row: usize, column: usize) -> DMatrix<f64> {
        let (rows, columns) = (self.width(row), self.width(column));
        let (low, high) = (row.min(column), row.max(column));
        match self.columns[low].get(&high) {
            Some(values) if row >= column => DMatrix::from_row_slice(rows, columns, values),
            Some(values) => DMatrix::from_row_slice(columns, rows, values).transpose(),
            None => DMatrix::zeros(rows, columns),
        }
    }

    /// Largest sum of absolute elements of a row, the rows and columns being multiplied by `scale`: the 1-norm of the scaled matrix.
    pub fn norm(&self, scale: &[f64]) -> f64 {
        let mut sums = vec![0.0_f64; self.order()];
        for (column, own) in self.columns.iter().enumerate() {
            let width = self.width(column);
            for (&row, values) in own {
                for (k, value) in values.iter().enumerate() {
                    let (i, j) = (self.starts[row] + k / width, self.starts[column] + k % width);
                    let size = (value * scale[i] * scale[j]).abs();
                    sums[i] += size;
                    sums[j] += if row == column { 0.0 } else { size };
                }
            }
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Multiplications that factorising takes; a dense factor takes a sixth of the cube of its order. Nothing is computed.
    pub fn multiplications(&self) -> f64 {
        Symbolic::new(self).multiplications()
    }

    /// The Cholesky factor in an order that leaves it sparse; `None` where the matrix is not positive definite.
    pub fn factor(&self) -> Option<BlockFactor> {
        BlockFactor::new(self, Symbolic::new(self))
    }
}
