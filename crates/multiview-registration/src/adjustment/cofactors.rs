//! Cofactors of all unknowns: those blocks of them that are asked for.

use nalgebra::{DMatrix, DVector, DVectorView, Matrix6};
use sparse_matrices::{BlockFactor, BlockInverse};

use crate::adjustment::wide_errors::Derivatives;

/// Inverse of the normal matrix of stations, shared parameters and wide planes, zero for the station that is held.
#[derive(Debug, Clone)]
pub(crate) struct Cofactors {
    inverse: BlockInverse,
    /// Where the rows of each station begin, those of the parameters, and those after them; a station that is held has none.
    starts: Vec<usize>,
}

impl Cofactors {
    pub(crate) fn new(factor: BlockFactor, starts: Vec<usize>) -> Self {
        Self { inverse: BlockInverse::new(factor), starts }
    }

    /// The block of the shared parameters: that after the stations.
    fn shared(&self) -> usize {
        self.starts.len() - 2
    }

    fn width(&self, block: usize) -> usize {
        self.starts[block + 1] - self.starts[block]
    }

    /// Number of unknowns of all stations, that which is held among them, and parameters.
    pub(crate) fn unknowns(&self) -> usize {
        6 * self.shared() + self.parameters()
    }

    pub(crate) fn parameters(&self) -> usize {
        self.width(self.shared())
    }

    /// Blocks of two stations that the factor holds.
    pub(crate) fn filled(&self) -> usize {
        // Parameters that are none have a block of their own.
        self.inverse.factor().filled() - usize::from(self.parameters() == 0)
    }

    /// Of a station's pose.
    pub(crate) fn of(&self, station: usize) -> Matrix6<f64> {
        self.between(station, station)
    }

    /// Between the poses of two stations.
    pub(crate) fn between(&self, first: usize, second: usize) -> Matrix6<f64> {
        if self.width(first) == 0 || self.width(second) == 0 {
            return Matrix6::zeros();
        }
        Matrix6::from_iterator(self.inverse.block(first, second).iter().copied())
    }

    /// Variance of what has these derivatives, at unit weight.
    pub(crate) fn variance(&self, derivatives: &Derivatives) -> f64 {
        let poses = derivatives.poses.iter().map(|(station, own)| (*station, own.as_slice()));
        let all = poses.chain([(self.shared(), derivatives.parameters.as_slice())]);
        let parts: Vec<(usize, DVectorView<'_, f64>)> = all
            .filter(|(block, _)| self.width(*block) > 0)
            .map(|(block, own)| (block, DVectorView::from_slice(own, own.len())))
            .collect();
        let mut sum = 0.0;
        for (n, (a, first)) in parts.iter().enumerate() {
            for (b, second) in &parts[..=n] {
                let Some(block) = self.inverse.selected(*a, *b) else { return self.solved_variance(&parts) };
                let product = first.dot(&(block * second));
                sum += if a == b { product } else { 2.0 * product };
            }
        }
        sum
    }

    /// The same where stations that no wall couples take part.
    fn solved_variance(&self, parts: &[(usize, DVectorView<'_, f64>)]) -> f64 {
        let mut all = DVector::zeros(self.inverse.factor().order());
        for (block, own) in parts {
            all.rows_mut(self.starts[*block], own.len()).copy_from(own);
        }
        self.inverse.factor().inverse_square(all.as_slice())
    }

    /// The product with the right side of the equations that they come from.
    pub(crate) fn times(&self, right: &DVector<f64>) -> DVector<f64> {
        DVector::from_vec(self.inverse.solve(right.as_slice()))
    }

    /// The whole matrix: six rows a station, then the shared parameters.
    pub(crate) fn whole(&self) -> DMatrix<f64> {
        let rows: Vec<(usize, usize)> = (0..=self.shared())
            .flat_map(|block| (0..self.width(block)).map(move |k| (6 * block + k, self.starts[block] + k)))
            .collect();
        let mut out = DMatrix::zeros(self.unknowns(), self.unknowns());
        for &(place, own) in &rows {
            let column = self.inverse.column(own);
            for &(other, row) in &rows {
                out[(other, place)] = column[row];
            }
        }
        0.5 * (&out + out.transpose())
    }
}
