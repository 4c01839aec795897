//! The covariance of all unknowns.

use nalgebra::{DMatrix, Matrix6};

use crate::adjustment::cofactors::Cofactors;

/// The covariance of all poses, in tangents `[dt world axes, dtheta station axes]`, and shared parameters. Of large networks only
/// those blocks are computed that are asked for: the whole matrix of a thousand stations takes 288 MB.
#[derive(Debug, Clone)]
pub struct JointCovariance {
    cofactors: Cofactors,
    factor: f64,
}

impl JointCovariance {
    pub(crate) fn new(cofactors: Cofactors, factor: f64) -> Self {
        let cofactors = match cofactors {
            Cofactors::Whole { matrix, stations } => {
                Cofactors::Whole { matrix: 0.5 * factor * (&matrix + matrix.transpose()), stations }
            }
            sparse @ Cofactors::Sparse(_) => return Self { cofactors: sparse, factor },
        };
        Self { cofactors, factor: 1.0 }
    }

    /// From the whole matrix of so many stations.
    pub(crate) fn of_whole(matrix: DMatrix<f64>, stations: usize) -> Self {
        Self { cofactors: Cofactors::Whole { matrix, stations }, factor: 1.0 }
    }

    /// Between the poses of two stations, which must be among those that were registered. In a large network this is quick for
    /// stations that share a wall, and takes some milliseconds for others.
    pub fn between(&self, first: usize, second: usize) -> Matrix6<f64> {
        self.factor * self.cofactors.between(first, second)
    }

    /// The whole matrix: six rows a station, then the shared parameters.
    pub fn whole(&self) -> DMatrix<f64> {
        match &self.cofactors {
            Cofactors::Whole { matrix, .. } => matrix.clone(),
            Cofactors::Sparse(_) => self.factor * self.cofactors.whole(),
        }
    }
}
