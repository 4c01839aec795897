//! Cofactors of all unknowns: the whole matrix, or of a large network those blocks of it that are needed.

use nalgebra::{DMatrix, DVector, Matrix6};
use sparse_matrices::{BlockFactor, BlockInverse};

use crate::adjustment::wide_errors::Derivatives;

/// Inverse of the normal matrix, zero for the station that is held.
#[derive(Debug, Clone)]
pub(crate) enum Cofactors {
    /// Six rows a station, then the shared parameters.
    Whole { matrix: DMatrix<f64>, stations: usize },
    /// Of a sparse normal matrix.
    Sparse(Box<SparseCofactors>),
}

/// The factor of a sparse normal matrix of stations and wide planes, and what was asked of its inverse.
#[derive(Debug, Clone)]
pub(crate) struct SparseCofactors {
    inverse: BlockInverse,
    /// Where the rows of each station begin, and at the end those of all.
    starts: Vec<usize>,
    /// The station that is held, which has no rows.
    fixed: usize,
}

impl Cofactors {
    pub(crate) fn sparse(factor: BlockFactor, starts: Vec<usize>, fixed: usize) -> Self {
        Self::Sparse(Box::new(SparseCofactors { inverse: BlockInverse::new(factor), starts, fixed }))
    }

    /// Number of unknowns of all stations, that which is held among them, and parameters.
    pub(crate) fn unknowns(&self) -> usize {
        match self {
            Self::Whole { matrix, .. } => matrix.nrows(),
            Self::Sparse(sparse) => 6 * (sparse.starts.len() - 1),
        }
    }

    pub(crate) fn parameters(&self) -> usize {
        match self {
            Self::Whole { matrix, stations } => matrix.nrows() - 6 * stations,
            Self::Sparse(_) => 0,
        }
    }

    /// Blocks of two stations that the factor holds.
    pub(crate) fn filled(&self) -> usize {
        match self {
            Self::Whole { stations, .. } => stations * (stations + 1) / 2,
            Self::Sparse(sparse) => sparse.inverse.factor().filled(),
        }
    }

    /// Of a station's pose.
    pub(crate) fn of(&self, station: usize) -> Matrix6<f64> {
        self.between(station, station)
    }

    /// Between the poses of two stations.
    pub(crate) fn between(&self, first: usize, second: usize) -> Matrix6<f64> {
        match self {
            Self::Whole { matrix, .. } => matrix.fixed_view::<6, 6>(6 * first, 6 * second).into_owned(),
            Self::Sparse(sparse) => sparse.between(first, second),
        }
    }

    /// Variance of what has these derivatives, at unit weight.
    pub(crate) fn variance(&self, derivatives: &Derivatives) -> f64 {
        match self {
            Self::Whole { matrix, stations } => {
                let mut all = DVector::zeros(matrix.nrows());
                for (&station, own) in &derivatives.poses {
                    all.fixed_rows_mut::<6>(6 * station).copy_from(own);
                }
                all.rows_mut(6 * stations, derivatives.parameters.len()).copy_from(&derivatives.parameters);
                all.dot(&(matrix * &all))
            }
            Self::Sparse(sparse) => sparse.variance(derivatives),
        }
    }

    /// The product with the right side of the equations that they come from.
    pub(crate) fn times(&self, right: &DVector<f64>) -> DVector<f64> {
        match self {
            Self::Whole { matrix, .. } => matrix * right,
            Self::Sparse(sparse) => {
                let mut out = right.clone();
                sparse.inverse.factor().solve(out.as_mut_slice());
                out
            }
        }
    }

    /// The whole matrix: six rows a station, then the shared parameters.
    pub(crate) fn whole(&self) -> DMatrix<f64> {
        match self {
            Self::Whole { matrix, .. } => matrix.clone(),
            Self::Sparse(sparse) => sparse.whole(),
        }
    }
}

impl SparseCofactors {
    fn between(&self, first: usize, second: usize) -> Matrix6<f64> {
        if first == self.fixed || second == self.fixed {
            return Matrix6::zeros();
        }
        Matrix6::from_iterator(self.inverse.block(first, second).iter().copied())
    }

    fn variance(&self, derivatives: &Derivatives) -> f64 {
        let poses: Vec<_> = derivatives.poses.iter().filter(|(station, _)| **station != self.fixed).collect();
        let mut sum = 0.0;
        for (n, (a, first)) in poses.iter().enumerate() {
            for (b, second) in &poses[..=n] {
                let Some(block) = self.inverse.selected(**a, **b) else { return self.solved_variance(derivatives) };
                let product = first.dot(&(block * *second));
                sum += if a == b { product } else { 2.0 * product };
            }
        }
        sum
    }

    /// The same where stations that no wall couples take part.
    fn solved_variance(&self, derivatives: &Derivatives) -> f64 {
        let mut all = DVector::zeros(self.inverse.factor().order());
        for (&station, own) in derivatives.poses.iter().filter(|(station, _)| **station != self.fixed) {
            all.fixed_rows_mut::<6>(self.starts[station]).copy_from(own);
        }
        self.inverse.factor().inverse_square(all.as_slice())
    }

    fn whole(&self) -> DMatrix<f64> {
        let stations = self.starts.len() - 1;
        let free: Vec<usize> = (0..stations).filter(|station| *station != self.fixed).collect();
        let mut out = DMatrix::zeros(6 * stations, 6 * stations);
        for &station in &free {
            for k in 0..6 {
                let column = self.inverse.column(self.starts[station] + k);
                for &other in &free {
                    let own = &column[self.starts[other]..self.starts[other] + 6];
                    out.fixed_view_mut::<6, 1>(6 * other, 6 * station + k).copy_from_slice(own);
                }
            }
        }
        0.5 * (&out + out.transpose())
    }
}
