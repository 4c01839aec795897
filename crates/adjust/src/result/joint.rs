use nalgebra::DMatrix;

use crate::linearised::layout::Place;
use crate::{BlockId, Error, Result, Scale, Solution};

impl Solution {
    /// Covariance matrix of several blocks together, in the order given; zero where a parameter was held.
    ///
    /// # Errors
    /// A block is unknown or named twice; [`Error::NoRedundancy`] for the posterior scale.
    pub fn covariance_of(&self, blocks: &[BlockId], scale: Scale) -> Result<DMatrix<f64>> {
        let offsets = self.offsets(blocks)?;
        let size = offsets[blocks.len()];
        let mut out = DMatrix::zeros(size, size);
        for (column, &second) in blocks.iter().enumerate() {
            for (row, &first) in blocks.iter().enumerate().skip(column) {
                let part = self.covariance_between(first, second, scale)?;
                let (i, j) = (offsets[row], offsets[column]);
                out.view_mut((i, j), part.shape()).copy_from(&part);
                out.view_mut((j, i), (part.ncols(), part.nrows())).copy_from(&part.transpose());
            }
        }
        Ok(out)
    }

    /// Where the components of each block begin when they are put one after the other, and at the end their number.
    pub(crate) fn offsets(&self, blocks: &[BlockId]) -> Result<Vec<usize>> {
        let mut sorted = blocks.to_vec();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(Error::Untestable { what: format!("block {}", pair[0].index()), reason: "it is named twice" });
        }
        let mut offsets = vec![0];
        for (index, &block) in blocks.iter().enumerate() {
            offsets.push(offsets[index] + self.tangent_dimension(block)?);
        }
        Ok(offsets)
    }

    /// `pᵀA` of one observed value, as unknowns and factors: p is its row of the weight matrix, A the Jacobian.
    pub(crate) fn weighted_design(&self, row: usize) -> Vec<(usize, f64)> {
        let Some(observation) = self.observation_of(row) else { return Vec::new() };
        let place = &self.layout.observations[observation];
        let (columns, component) = (self.columns_of(place), row - place.row);
        let whitening = &self.whitening[self.whitening_start[observation]..];
        let jacobian = &self.linearisation.jacobian[place.jacobian_range()];
        let term = |(entry, &column): (usize, &usize)| {
            let weighted = |i: usize| whitening[i * (i + 1) / 2 + component] * jacobian[i * columns.len() + entry];
            (column, (component..place.dimension).map(weighted).sum())
        };
        columns.iter().enumerate().map(term).collect()
    }

    /// `Q x` for a row x over the unknowns.
    pub(crate) fn spread(&self, row: &[(usize, f64)]) -> Vec<f64> {
        let mut x = vec![0.0; self.unknowns()];
        for &(column, factor) in row {
            x[column] += factor;
        }
        self.cofactor.multiply(&x)
    }

    /// Unknowns that the entries in a row of an observation's Jacobian belong to.
    pub(crate) fn columns_of(&self, place: &Place) -> Vec<usize> {
        self.layout.columns(place).collect()
    }

    /// The observation that a row belongs to.
    pub(crate) fn observation_of(&self, row: usize) -> Option<usize> {
        let after = self.layout.observations.partition_point(|place| place.row <= row);
        (row < self.observations()).then(|| after.saturating_sub(1))
    }
}
