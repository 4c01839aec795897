//! Where a mounted camera is, with everything that is not known exactly in it.

use rigid_pose::{Uncertain, inverse_jacobian, pose_difference, product_jacobians, symmetrised};

use crate::mounting::carrier::{Span, TimedPose};
use crate::mounting::options::Mounting;

impl Mounting {
    /// `target_from_camera` at a time of the camera's clock, second, with its covariance: from the poses of the carrier around it,
    /// the mounting, the target's place (both with their correlation) and, to first order and as if it were independent, the time
    /// offset. `None` where the carrier's trajectory does not cover it, or leaves more than `max_gap_s`.
    ///
    /// Covariances of camera poses at different times share the mounting's part.
    pub fn camera_at(&self, carrier: &[TimedPose], time_s: f64, max_gap_s: f64) -> Option<Uncertain> {
        let [offset_s, offset_sigma_s] = self.time_offset_s.unwrap_or([0.0; 2]);
        let pose = |time_s: f64| Span::at(carrier, time_s, max_gap_s).map(|span| span.pose(time_s));
        let world_from_carrier = pose(time_s + offset_s)?;
        let (target, mounting) = (&self.world_from_target, &self.carrier_from_camera);
        let target_from_world = target.pose.inverse();
        let (by_world, by_carrier) = product_jacobians(&target_from_world, &world_from_carrier.pose);
        let target_from_carrier = target_from_world * world_from_carrier.pose;
        let (by_first, by_mounting) = product_jacobians(&target_from_carrier, &mounting.pose);
        let (by_target, by_carrier) = (by_first * by_world * inverse_jacobian(&target.pose), by_first * by_carrier);
        let shared = by_mounting * self.cross_covariance * by_target.transpose();
        let mut covariance = by_carrier * world_from_carrier.covariance * by_carrier.transpose()
            + by_mounting * mounting.covariance * by_mounting.transpose()
            + by_target * target.covariance * by_target.transpose()
            + shared
            + shared.transpose();
        let camera = target_from_carrier * mounting.pose;
        if let Some(later) =
            pose(time_s + offset_s + offset_sigma_s).or_else(|| pose(time_s + offset_s - offset_sigma_s))
        {
            let moved = pose_difference(&camera, &self.target_from_camera(&later.pose));
            covariance += moved * moved.transpose();
        }
        Some(Uncertain { pose: camera, covariance: symmetrised(&covariance) })
    }
}
