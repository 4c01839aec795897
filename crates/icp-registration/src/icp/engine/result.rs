//! What a registration returns.

use nalgebra::{Isometry3, Matrix6};

use crate::error::Result;
use crate::icp::engine::matching::Points;
use crate::icp::engine::options::DegeneracyPolicy;
use crate::icp::engine::quality::verdict;
use crate::icp::engine::registration::{Engine, Track};
use crate::icp::engine::sensitivity::sensitivity;
use crate::icp::engine::system::System;
use crate::icp::motion::UndeterminedMotion;
use crate::icp::prior::fused_with_prior;
use crate::parts::{Moment, Scene, thinned};
use crate::quality::Residuals;

/// Source points from which the response of the score and the overlap are taken.
const RESPONSE_POINTS: usize = 4000;
const OVERLAP_POINTS: usize = 20_000;

/// Why the iterations ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StopReason {
    /// The last step was below the tolerance.
    Converged,
    /// The pose wanders by less than a tenth of its standard deviation, as pairs change back and forth.
    WithinNoise,
    /// The iterations were used up: do not trust the pose.
    MaxIterations,
    /// Iterations ended, but the frames contradict each other at the pose, hide too much from each other or hardly meet:
    /// do not trust it.
    Contradicted,
}

/// Result of a registration.
#[derive(Debug, Clone, PartialEq)]
pub struct IcpResult {
    /// Pose: `target = target_from_source * source`.
    pub target_from_source: Isometry3<f64>,
    /// Covariance in the tangent `[dt target axes (m), dtheta source axes (rad)]`. Motions that the pairs say nothing
    /// about carry the radius of the pairs as standard deviation.
    pub covariance: Matrix6<f64>,
    /// Fraction of the source points that have a partner at the final pose.
    pub overlap: f64,
    /// Root mean square residual of the metric, weighted by the kernel, metre.
    pub rms_m: f64,
    /// Iterations in all levels together.
    pub iterations: usize,
    /// Why they ended.
    pub stop: StopReason,
    /// Pairs in the last iteration.
    pub correspondences: usize,
    /// Distance limit of the last level, metre.
    pub max_correspondence_distance_m: f64,
    /// Motions that the geometry does not determine; empty for a sound pose.
    pub degenerate: Vec<UndeterminedMotion>,
}

impl IcpResult {
    /// Whether the iterations settled, the geometry determines all six unknowns, and frames do not contradict the pose.
    pub fn is_trustworthy(&self) -> bool {
        !matches!(self.stop, StopReason::MaxIterations | StopReason::Contradicted) && self.degenerate.is_empty()
    }
}

impl Engine<'_> {
    /// Judges the pose at the end of a track.
    pub(in crate::icp) fn result(
        &self,
        track: &Track,
        points: &mut Points,
        limits: &[f64],
        guess: &Isometry3<f64>,
        stop: StopReason,
    ) -> Result<IcpResult> {
        let moment = Moment { ended: true, ..track.moment(limits, limits.len() - 1, 0) };
        let scene = self.scene.at(moment);
        let gated = self.gated_pairs(&scene, points)?;
        let overlap = if points.indices.len() == scene.source.len() {
            gated.len() as f64 / points.indices.len() as f64
        } else {
            self.overlap(&scene)?
        };
        let pairs = self.enough(&scene, gated, points, track.iterations)?;
        let system = System::new(&scene, self.metric, &pairs, self.kernel.at(&moment));
        let verdict = verdict(&system, self.max_motion_sigma_m(), Residuals::Settled)?;
        let sample = thinned(&points.indices, RESPONSE_POINTS);
        let step_m = (0.5 * system.rms_m()).max(0.01 * moment.limit_m);
        let response = sensitivity(self, &system, &sample, step_m)?;
        let mut result = IcpResult {
            target_from_source: track.pose,
            covariance: verdict.covariance(&track.pose, Some(&response)),
            overlap,
            rms_m: system.rms_m(),
            iterations: track.iterations,
            stop,
            correspondences: pairs.len(),
            max_correspondence_distance_m: moment.limit_m,
            degenerate: verdict.undetermined(),
        };
        if let (DegeneracyPolicy::HoldAtPrior, Some(prior)) = (self.parts.degeneracy, &self.parts.prior_covariance) {
            let information = verdict.information(&track.pose, &response);
            (result.target_from_source, result.covariance) = fused_with_prior(&track.pose, &information, guess, prior)?;
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
