//! Normal equations of which few blocks are filled, as those of stations that only their neighbours tie together.

use sparse_matrices::{BlockInverse, BlockMatrix};

use crate::Adjustment;
use crate::equations::normal::{Singular, damping_of, unit_scale};
use crate::linearised::layout::Layout;
use crate::linearised::linearisation::Linearisation;

/// Fewest unknowns, most observations a block, and share of a dense factor's multiplications from which on a sparse factor is
/// faster: a dense one takes a tenth of the time for each. Networks with many observations a block have points to eliminate.
const FEWEST: usize = 300;
const MOST_OBSERVATIONS: usize = 50;
const SHARE: f64 = 0.1;

/// `N dx = g` in the blocks of the parameters.
#[derive(Debug, Clone)]
pub(crate) struct SparseNormal {
    pub(crate) matrix: BlockMatrix,
    pub(crate) gradient: Vec<f64>,
}

/// The factor of N, perhaps damped, and what makes its diagonal one.
#[derive(Debug, Clone)]
pub(crate) struct SparseFactor {
    pub(crate) inverse: BlockInverse,
    pub(crate) scale: Vec<f64>,
}

impl SparseNormal {
    /// `None` where another form is faster, or constraints tie all unknowns together.
    pub(crate) fn choose(adjustment: &Adjustment<'_>, layout: &Layout) -> Option<Self> {
        let is_crowded = layout.observations.len() > MOST_OBSERVATIONS * layout.blocks();
        if layout.unknowns < FEWEST || is_crowded || layout.constraint_rows > 0 || adjustment.datum.is_some() {
            return None;
        }
        let widths: Vec<usize> = (0..layout.blocks()).map(|block| layout.free(block).len()).collect();
        let mut matrix = BlockMatrix::new(&widths);
        for parts in layout.observations.iter().map(|place| layout.parts(place)) {
            for (index, part) in parts.iter().enumerate() {
                parts[..=index]
                    .iter()
                    .for_each(|other| matrix.add(part.block as usize, other.block as usize, |_, _| 0.0));
            }
        }
        let dense = (layout.unknowns as f64).powi(3) / 6.0;
        (matrix.multiplications() < SHARE * dense).then(|| Self { matrix, gradient: vec![0.0; layout.unknowns] })
    }

    /// Sums over all observations in the order of adding.
    pub(crate) fn accumulate(&mut self, layout: &Layout, linearisation: &Linearisation) {
        self.matrix.clear();
        self.gradient.fill(0.0);
        for place in &layout.observations {
            let (parts, jacobian) = (layout.parts(place), &linearisation.jacobian[place.jacobian_range()]);
            for (row, entries) in place.rows().zip(jacobian.chunks_exact(place.width.max(1))) {
                let (residual, weight) = (linearisation.whitened[row], linearisation.weights[row]);
                for (index, part) in parts.iter().enumerate() {
                    let own = &entries[part.entries()];
                    self.gradient[part.columns()]
                        .iter_mut()
                        .zip(own)
                        .for_each(|(sum, a)| *sum += weight * a * residual);
                    for other in &parts[..=index] {
                        let others = &entries[other.entries()];
                        let product = |i: usize, j: usize| weight * own[i] * others[j];
                        self.matrix.add(part.block as usize, other.block as usize, product);
                    }
                }
            }
        }
    }

    /// `damping` are λ and the scale that the damping is measured in.
    pub(crate) fn factor(&self, damping: Option<(f64, &[f64])>) -> Result<SparseFactor, Singular> {
        let (scale, mut matrix) = (unit_scale(&self.matrix.diagonal()), self.matrix.clone());
        if let Some((lambda, reference)) = damping {
            for (row, (own, reference)) in scale.iter().zip(reference).enumerate() {
                matrix.add_to_diagonal(row, damping_of(lambda, *own, *reference));
            }
        }
        let inverse = BlockInverse::new(matrix.factor().ok_or(Singular::Normal)?);
        Ok(SparseFactor { inverse, scale })
    }
}
