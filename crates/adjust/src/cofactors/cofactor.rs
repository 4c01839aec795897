//! Cofactors `Q = N⁻¹` of the unknowns, as a matrix or in the eliminated form.

use nalgebra::DMatrix;

use crate::cofactors::eliminated_cofactor::EliminatedCofactor;
use crate::equations::elimination::EliminatedFactor;
use crate::equations::structure::Role;
use crate::linearised::layout::Layout;

/// Cofactors of all unknowns.
#[derive(Debug, Clone)]
pub(crate) enum Cofactor {
    /// Full, column-major; what makes the diagonal of N one; and the trace of the scaled inverse.
    Dense {
        matrix: Vec<f64>,
        scale: Vec<f64>,
        trace: f64,
    },
    Eliminated(Box<EliminatedCofactor>),
}

impl Cofactor {
    /// From the cofactor matrix of unknowns in units of `scale`.
    pub(crate) fn dense(mut matrix: Vec<f64>, scale: Vec<f64>, trace: f64) -> Self {
        for (column, own) in matrix.chunks_exact_mut(scale.len().max(1)).zip(&scale) {
            column.iter_mut().zip(&scale).for_each(|(q, other)| *q *= own * other);
        }
        Self::Dense { matrix, scale, trace }
    }

    pub(crate) fn eliminated(factor: EliminatedFactor) -> Self {
        Self::Eliminated(Box::new(EliminatedCofactor::new(factor)))
    }

    /// What makes the diagonal of N one.
    pub(crate) fn scale(&self) -> &[f64] {
        match self {
            Self::Dense { scale, .. } => scale,
            Self::Eliminated(cofactor) => cofactor.scale(),
        }
    }

    pub(crate) fn is_eliminated(&self, block: usize) -> bool {
        match self {
            Self::Dense { .. } => false,
            Self::Eliminated(cofactor) => matches!(cofactor.factor.structure.roles[block], Role::Eliminated(_)),
        }
    }

    /// Between the free parameters of two blocks.
    pub(crate) fn block(&self, layout: &Layout, first: usize, second: usize) -> DMatrix<f64> {
        match self {
            Self::Dense { matrix, scale, .. } => {
                let (rows, columns) = (layout.free(first), layout.free(second));
                DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
                    matrix[(columns.start + j) * scale.len() + rows.start + i]
                })
            }
            Self::Eliminated(cofactor) => cofactor.block(layout, first, second),
        }
    }

    pub(crate) fn element(&self, layout: &Layout, row: usize, column: usize) -> f64 {
        match self {
            Self::Dense { matrix, scale, .. } => matrix[column * scale.len() + row],
            Self::Eliminated(_) => {
                let (first, second) = (layout.block_of(row), layout.block_of(column));
                let block = self.block(layout, first, second);
                block[(row - layout.free(first).start, column - layout.free(second).start)]
            }
        }
    }

    /// Variances of all unknowns.
    pub(crate) fn diagonal(&self, layout: &Layout) -> Vec<f64> {
        (0..layout.blocks())
            .flat_map(|block| self.block(layout, block, block).diagonal().data.as_vec().clone())
            .collect()
    }

    /// `Q x`.
    pub(crate) fn multiply(&self, x: &[f64]) -> Vec<f64> {
        match self {
            Self::Dense { matrix, scale, .. } => {
                let columns = matrix.chunks_exact(scale.len().max(1));
                columns.map(|q| q.iter().zip(x).map(|(q, x)| q * x).sum()).collect()
            }
            Self::Eliminated(cofactor) => cofactor.multiply(x),
        }
    }

    /// Upper bound of the condition of the whitened Jacobian with unit columns.
    pub(crate) fn condition(&self, layout: &Layout) -> f64 {
        let trace = match self {
            Self::Dense { trace, .. } => *trace,
            Self::Eliminated(cofactor) => {
                let variances = self.diagonal(layout).into_iter().zip(cofactor.scale());
                variances.map(|(q, s)| q / (s * s)).sum::<f64>() + cofactor.datum_trace()
            }
        };
        (trace * layout.unknowns as f64).sqrt().max(1.0)
    }
}
