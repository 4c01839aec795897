//! The covariance of all unknowns.

use nalgebra::{DMatrix, Isometry3, Matrix6};

use crate::adjustment::cofactors::Cofactors;
use crate::adjustment::network::relative_jacobians;

/// The covariance of all poses, in tangents `[dt world axes, dtheta station axes]`, and shared parameters. Of large networks only
/// those blocks are computed that are asked for.
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

    /// Pose and covariance of one station in the frame of another, at these poses.
    pub(crate) fn relative_pose(
        &self,
        poses: &[Isometry3<f64>],
        target: usize,
        source: usize,
    ) -> (Isometry3<f64>, Matrix6<f64>) {
        let (of_target, of_source) = (&poses[target], &poses[source]);
        let jacobians = relative_jacobians(of_target, of_source);
        let mut covariance = Matrix6::zeros();
        for (a, left) in [target, source].into_iter().zip(&jacobians) {
            for (b, right) in [target, source].into_iter().zip(&jacobians) {
                covariance += left * self.between(a, b) * right.transpose();
            }
        }
        (of_target.inverse() * of_source, rigid_pose::symmetrised(&covariance))
    }

    /// The whole matrix: six rows a station, then the shared parameters.
    pub fn whole(&self) -> DMatrix<f64> {
        match &self.cofactors {
            Cofactors::Whole { matrix, .. } => matrix.clone(),
            Cofactors::Sparse(_) => self.factor * self.cofactors.whole(),
        }
    }
}
