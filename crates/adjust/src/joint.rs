use nalgebra::{DMatrix, DVector};

use crate::layout::{HELD, Place};
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
            return Err(Error::Untestable { what: format!("block {}", pair[0].0), reason: "it is named twice" });
        }
        let mut offsets = vec![0];
        for (index, &block) in blocks.iter().enumerate() {
            offsets.push(offsets[index] + self.tangent_dimension(block)?);
        }
        Ok(offsets)
    }

    /// `pᵀA` of one observed value: p is its row of the weight matrix, A the Jacobian.
    pub(crate) fn weighted_design(&self, row: usize, owners: &[(BlockId, usize)]) -> WeightedDesign {
        let Some(observation) = self.observation_of(row) else { return WeightedDesign::default() };
        let place = &self.layout.observations[observation];
        let (columns, component) = (self.columns_of(place), row - place.row);
        let whitening = &self.whitening[self.whitening_start[observation]..];
        let jacobian = &self.linearisation.jacobian[place.jacobian_range()];
        let mut terms = Vec::with_capacity(columns.len());
        for (entry, &column) in columns.iter().enumerate() {
            let weighted = |i: usize| whitening[i * (i + 1) / 2 + component] * jacobian[i * columns.len() + entry];
            terms.push((owners[column], (component..place.dimension).map(weighted).sum()));
        }
        WeightedDesign { terms }
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

    /// Block and component of each unknown.
    pub(crate) fn owners(&self) -> Vec<(BlockId, usize)> {
        let mut owners = vec![(BlockId(0), 0); self.layout.unknowns];
        for block in 0..self.blocks.len() {
            for (component, &column) in self.layout.block_columns(block).iter().enumerate() {
                if column != HELD {
                    owners[column] = (BlockId(block), component);
                }
            }
        }
        owners
    }
}

/// A row over the unknowns: parameters with their factors. A parameter may occur twice.
#[derive(Debug, Clone, Default)]
pub(crate) struct WeightedDesign {
    terms: Vec<((BlockId, usize), f64)>,
}

impl WeightedDesign {
    /// The blocks touched, sorted.
    pub(crate) fn blocks(&self) -> Vec<BlockId> {
        let mut blocks: Vec<_> = self.terms.iter().map(|((block, _), _)| *block).collect();
        blocks.sort_unstable();
        blocks.dedup();
        blocks
    }

    /// The row over `blocks`, put one after the other at `offsets`; `blocks` are sorted.
    pub(crate) fn over(&self, blocks: &[BlockId], offsets: &[usize]) -> DVector<f64> {
        let mut out = DVector::zeros(offsets[blocks.len()]);
        for &((block, component), factor) in &self.terms {
            if let Ok(index) = blocks.binary_search(&block) {
                out[offsets[index] + component] += factor;
            }
        }
        out
    }
}
