//! In which order block rows are eliminated, and where the factor is filled.

use std::collections::BTreeSet;

use crate::matrix::BlockMatrix;

/// Where the factor is filled: the block row with the fewest filled neighbours goes first, again and again (minimum degree).
#[derive(Debug, Clone)]
pub(crate) struct Symbolic {
    /// The block row at each position.
    pub(crate) order: Vec<usize>,
    /// Where each block row is eliminated.
    pub(crate) position: Vec<usize>,
    /// Positions of the filled block rows below the diagonal, by position, ascending.
    pub(crate) below: Vec<Vec<u32>>,
    /// Widths by position.
    pub(crate) widths: Vec<usize>,
}

impl Symbolic {
    pub(crate) fn new(matrix: &BlockMatrix) -> Self {
        let count = matrix.blocks();
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); count];
        for (column, own) in matrix.columns.iter().enumerate() {
            for &row in own.keys().filter(|row| **row != column) {
                around[column].push(row as u32);
                around[row].push(column as u32);
            }
        }
        for neighbours in &mut around {
            neighbours.sort_unstable();
        }
        let rows = |neighbours: &[u32]| neighbours.iter().map(|&other| matrix.width(other as usize)).sum::<usize>();
        let mut degree: Vec<usize> = around.iter().map(|neighbours| rows(neighbours)).collect();
        let mut open: BTreeSet<(usize, usize)> = degree.iter().copied().zip(0..).collect();
        let (mut order, mut position) = (Vec::with_capacity(count), vec![0; count]);
        let mut below = Vec::with_capacity(count);
        while let Some((_, next)) = open.pop_first() {
            let own = std::mem::take(&mut around[next]);
            for &other in &own {
                let other = other as usize;
                around[other] = united(&around[other], &own, next as u32, other as u32);
                open.remove(&(degree[other], other));
                degree[other] = rows(&around[other]);
                open.insert((degree[other], other));
            }
            position[next] = order.len();
            order.push(next);
            below.push(own);
        }
        for own in &mut below {
            for block in own.iter_mut() {
                *block = position[*block as usize] as u32;
            }
            own.sort_unstable();
        }
        let widths = order.iter().map(|&block| matrix.width(block)).collect();
        Self { order, position, below, widths }
    }

    pub(crate) fn multiplications(&self) -> f64 {
        let of = |(own, width): (&Vec<u32>, &usize)| {
            let (width, rows) =
                (*width as f64, own.iter().map(|&other| self.widths[other as usize]).sum::<usize>() as f64);
            width.powi(3) / 6.0 + rows * width * width / 2.0 + rows * rows * width / 2.0
        };
        self.below.iter().zip(&self.widths).map(of).sum()
    }
}

/// Both ascending lists in one, without two of their elements.
fn united(a: &[u32], b: &[u32], without: u32, nor: u32) -> Vec<u32> {
    let mut out = Vec::with_capacity(a.len() + b.len());
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(&x), Some(&y)) => x.min(y),
            (Some(&x), None) => x,
            (None, Some(&y)) => y,
            (None, None) => break,
        };
        i += usize::from(a.get(i) == Some(&next));
        j += usize::from(b.get(j) == Some(&next));
        if next != without && next != nor {
            out.push(next);
        }
    }
    out
}
