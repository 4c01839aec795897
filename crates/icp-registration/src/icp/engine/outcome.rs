//! The pose judged at the end of a track.

use nalgebra::Isometry3;

use crate::error::Result;
use crate::icp::engine::matching::Points;
use crate::icp::engine::quality::verdict;
use crate::icp::engine::registration::{Engine, Track};
use crate::icp::engine::sensitivity::sensitivity;
use crate::icp::prior::fused_with_prior;
use crate::parts::{Moment, Scene, thinned};
use crate::result::{DegeneracyPolicy, IcpResult, StopReason};
use crate::system::System;
use rigid_pose::Uncertain;

/// Source points from which the overlap is taken where not all are selected.
const OVERLAP_POINTS: usize = 20_000;

impl Engine<'_> {
    /// Judges the pose at the end of a track.
    pub(in crate::icp) fn result(
        &self,
        track: &Track,
        points: &mut Points,
        limit_m: f64,
        guess: &Isometry3<f64>,
        stop: StopReason,
    ) -> Result<IcpResult> {
        let moment = Moment { ended: true, ..track.moment(limit_m) };
        let scene = self.scene.at(moment);
        let gated = self.gated_pairs(&scene, points)?;
        let overlap = if points.indices.len() == scene.source.len() {
            gated.len() as f64 / points.indices.len() as f64
        } else {
            self.overlap(&scene)?
        };
        let pairs = self.enough(&scene, gated, points, track.iterations)?;
        let system = System::new(&scene, self.metric, &pairs, self.kernel);
        let verdict = verdict(&system, self.max_motion_sigma_m())?;
        let sample = thinned(&points.indices, self.parts.levels.points);
        let step_m = (0.5 * system.rms_m()).max(0.01 * limit_m);
        let response = sensitivity(self, &system, &sample, step_m)?;
        let mut result = IcpResult {
            target_from_source: track.pose,
            covariance: verdict.covariance(&track.pose, Some(&response)),
            overlap,
            rms_m: system.rms_m(),
            iterations: track.iterations,
            stop,
            correspondences: pairs.len(),
            max_correspondence_distance_m: limit_m,
            degenerate: verdict.undetermined(),
        };
        if let (DegeneracyPolicy::HoldAtPrior, Some(prior)) = (self.parts.degeneracy, &self.parts.prior_covariance) {
            let fused = fused_with_prior(&Uncertain { pose: track.pose, covariance: result.covariance }, guess, prior)?;
            (result.target_from_source, result.covariance) = (fused.pose, fused.covariance);
        }
        Ok(result)
    }

    /// Fraction of the source points with a partner that every part keeps.
    fn overlap(&self, scene: &Scene<'_>) -> Result<f64> {
        let all = thinned(&(0..scene.source.len()).collect::<Vec<_>>(), OVERLAP_POINTS);
        let of = all.len();
        Ok(self.gated_pairs(scene, &mut Points::new(all))?.len() as f64 / of as f64)
    }
}
