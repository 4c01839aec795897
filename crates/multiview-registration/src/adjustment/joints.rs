//! What rays tell of the relative pose of two stations where hardly any surface does.

use nalgebra::{DVector, Isometry3, RowVector6, Vector6};

use crate::adjustment::equations::{Equations, Rows};
use rigid_pose::{pose_difference, relative_jacobians};

/// A relative pose that is observed along one motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Joint {
    /// One on either side.
    pub stations: [usize; 2],
    /// The second in the frame of the first.
    pub first_from_second: Isometry3<f64>,
    /// How far along the motion, metre, by the tangent of that pose.
    pub along: Vector6<f64>,
    /// Standard deviation, metre.
    pub sigma_m: f64,
}

impl Joint {
    pub(crate) fn add_to(&self, equations: &mut Equations, poses: &[Isometry3<f64>]) {
        let [first, second] = self.stations.map(|station| poses[station]);
        let relative = first.inverse() * second;
        let off = pose_difference(&relative, &self.first_from_second);
        let row: RowVector6<f64> = self.along.transpose() / self.sigma_m;
        let rows = relative_jacobians(&first, &relative).map(|by| Rows::from_rows(&[row * by]));
        let residual = DVector::from_element(1, -row.transpose().dot(&off));
        equations.add_rows(self.stations, [&rows[0], &rows[1]], None, &residual);
    }
}
