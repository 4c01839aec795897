//! The covariance of all unknowns.

use nalgebra::{DMatrix, Isometry3, Matrix6};

use crate::adjustment::cofactors::Cofactors;
use rigid_pose::relative_jacobians;

/// The covariance of all poses, in tangents `[dt world axes, dtheta station axes]`, and shared parameters. Of large networks only
/// those blocks are computed that are asked for.
#[derive(Debug, Clone)]
pub struct JointCovariance(Form);

#[derive(Debug, Clone)]
enum Form {
    /// Cofactors, and their factor.
    Factored(Box<Cofactors>, f64),
    Whole(DMatrix<f64>),
}

impl JointCovariance {
    pub(crate) fn new(cofactors: Cofactors, factor: f64) -> Self {
        Self(Form::Factored(Box::new(cofactors), factor))
    }

    /// From the whole matrix.
    pub(crate) fn of_whole(matrix: DMatrix<f64>) -> Self {
        Self(Form::Whole(matrix))
    }

    /// Between the poses of two stations, which must be among those that were registered. In a large network this is quick for
    /// stations that share a wall, and takes some milliseconds for others.
    pub fn between(&self, first: usize, second: usize) -> Matrix6<f64> {
        match &self.0 {
            Form::Factored(cofactors, factor) => *factor * cofactors.between(first, second),
            Form::Whole(matrix) => matrix.fixed_view::<6, 6>(6 * first, 6 * second).into_owned(),
        }
    }

    /// Pose and covariance of one station in the frame of another, at these poses.
    pub(crate) fn relative_pose(
        &self,
        poses: &[Isometry3<f64>],
        target: usize,
        source: usize,
    ) -> (Isometry3<f64>, Matrix6<f64>) {
        let pose = poses[target].inverse() * poses[source];
        let jacobians = relative_jacobians(&poses[target], &pose);
        let mut covariance = Matrix6::zeros();
        for (a, left) in [target, source].into_iter().zip(&jacobians) {
            for (b, right) in [target, source].into_iter().zip(&jacobians) {
                covariance += left * self.between(a, b) * right.transpose();
            }
        }
        (pose, rigid_pose::symmetrised(&covariance))
    }

    /// The whole matrix: six rows a station, then the shared parameters.
    pub fn whole(&self) -> DMatrix<f64> {
        match &self.0 {
            Form::Factored(cofactors, factor) => *factor * cofactors.whole(),
            Form::Whole(matrix) => matrix.clone(),
        }
    }
}
