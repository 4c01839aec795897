//! One frame against one keyframe, and the search among those nearby.

use nalgebra::Isometry3;

use super::keyframes::SAMPLE;
use super::motion::Uncertain;
use super::prediction::Prediction;
use super::tracked::LossReason;
use super::tracker::Tracker;
use crate::error::Error;
use crate::organised::Agreement;

/// Keyframes tried beside the reference.
const NEIGHBOURS: usize = 2;
/// Square of the Mahalanobis distance (six components) beyond which a prior is not believed against the registration.
const DISBELIEF: f64 = 40.0;

/// A registration that passed its tests.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measured {
    /// Index of the keyframe.
    pub(super) keyframe: usize,
    /// Keyframe from camera.
    pub(super) pose: Uncertain,
    /// Whether the geometry determines all motions.
    pub(super) determined: bool,
    pub(super) agreement: Agreement,
    pub(super) rms_m: f64,
}

impl Tracker {
    /// Registers the current frame with keyframe `k`.
    pub(super) fn try_keyframe(&mut self, k: usize, guess: &Isometry3<f64>) -> Result<Measured, LossReason> {
        let keyframe = &self.keyframes.list[k].frame;
        let result = self.aligner.align(&self.current, keyframe, guess).map_err(|error| match error {
            Error::TooFewPoints { .. } => LossReason::TooFewPoints,
            Error::TooFewCorrespondences { .. } => LossReason::TooLittleOverlap,
            _ => LossReason::NotConverged,
        })?;
        let pose = Uncertain { pose: result.target_from_source, covariance: result.covariance };
        let agreement = keyframe.agreement(&self.current, &pose.pose, SAMPLE);
        if agreement.consent() < self.options.min_agreement {
            return Err(LossReason::LargeResiduals);
        }
        if agreement.overlap() < self.options.min_overlap {
            return Err(LossReason::TooLittleOverlap);
        }
        if !crate::pose::is_finite(&pose.pose) || pose.covariance.cholesky().is_none() {
            return Err(LossReason::NotConverged);
        }
        let determined = result.degenerate.is_empty();
        Ok(Measured { keyframe: k, pose, determined, agreement, rms_m: result.rms_m })
    }

    /// The current frame near its predicted pose: from the reference, or from keyframes that should see the same.
    pub(super) fn near(&mut self, reference: usize, prediction: &Prediction) -> Result<Measured, LossReason> {
        let usable = |m: &Measured| m.determined || prediction.informed;
        let first = self.try_keyframe(reference, &prediction.own.pose);
        if let Ok(measured) = first
            && usable(&measured)
        {
            return Ok(measured);
        }
        let reason = first.err().unwrap_or(LossReason::Undetermined);
        let candidates = self.keyframes.candidates(&self.current, reference, &prediction.own.pose, reference);
        for (_, k) in candidates.into_iter().take(NEIGHBOURS) {
            let guess = self.keyframes.graph.relative(k, reference) * prediction.own.pose;
            if let Ok(measured) = self.try_keyframe(k, &guess)
                && measured.determined
            {
                return Ok(measured);
            }
        }
        Err(reason)
    }

    /// The pose from a registration and a prediction with its covariance: both are weighted, and what the geometry
    /// leaves open stays with the prediction.
    ///
    /// Half of the covariance of the registration is the keyframe's noise, which all frames registered with it share;
    /// only the other half averages out with the prediction.
    pub(super) fn weighted(&self, measured: &Measured, prediction: &Prediction) -> Result<Uncertain, LossReason> {
        let half = Uncertain { pose: measured.pose.pose, covariance: measured.pose.covariance * 0.5 };
        if !prediction.informed {
            return if measured.determined { Ok(half) } else { Err(LossReason::Undetermined) };
        }
        let contradicted = half.mahalanobis_squared(&prediction.own).is_none_or(|m| m > DISBELIEF);
        if measured.determined && contradicted {
            return Ok(half);
        }
        let pose = half.combined(&prediction.own).ok_or(LossReason::Undetermined)?;
        let carried = pose.sigma_at(self.current.radius_m()) <= self.options.max_carried_sigma_m;
        if carried || measured.determined { Ok(pose) } else { Err(LossReason::Undetermined) }
    }
}
