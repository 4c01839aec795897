//! One frame against one keyframe, and the search among those nearby.

use nalgebra::{Isometry3, Matrix6};

use super::keyframes::SAMPLE;
use super::motion::Uncertain;
use super::options::TrackerOptions;
use super::prediction::{Last, Prediction};
use super::tracked::LossReason;
use super::tracker::Tracker;
use crate::error::Error;
use crate::organised::{Agreement, FrameAligner, OrganisedFrame};

/// Keyframes tried beside the reference.
const NEIGHBOURS: usize = 2;
/// Square of the Mahalanobis distance (six components) beyond which a prior is not believed against the registration.
const DISBELIEF: f64 = 40.0;
/// Share of the largest standard deviation of carried poses that is allowed where only the velocity carries them.
const BY_VELOCITY: f64 = 0.25;
/// What a pose found against expectation must agree by: fraction of the frame, and of what can be judged.
pub(super) const LEAST_OVERLAP: f64 = 0.5;
pub(super) const LEAST_CONSENT: f64 = 0.9;

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
        let target = &self.keyframes.list[k].frame;
        register(&mut self.aligner, &self.options, &self.current, target, guess)
            .map(|measured| Measured { keyframe: k, ..measured })
    }

    /// The frame before as a new keyframe, where it determines what its own keyframe, with less in common, does not.
    fn from_previous(&mut self, last: &Last, prediction: &Prediction) -> Option<Measured> {
        let exact = last.own.covariance == Matrix6::zeros();
        if last.lost_frames > 0 || last.carried > 0 || exact {
            return None;
        }
        let guess = last.own.pose.inverse() * prediction.own.pose;
        let measured = register(&mut self.aligner, &self.options, &self.current, &self.previous, &guess).ok()?;
        measured.determined.then(|| {
            let total = Uncertain { covariance: last.own.covariance + last.shared, ..last.own };
            let keyframe = self.keyframes.add(self.previous.clone(), last.keyframe, &total);
            Measured { keyframe, ..measured }
        })
    }

    /// The current frame near its predicted pose: from the reference, or from keyframes that should see the same.
    pub(super) fn near(&mut self, last: &Last, prediction: &Prediction) -> Result<Measured, LossReason> {
        let reference = last.keyframe;
        let first = self.try_keyframe(reference, &prediction.own.pose);
        if let Ok(measured) = first
            && measured.determined
        {
            return Ok(measured);
        }
        if let Some(measured) = self.from_previous(last, prediction) {
            return Ok(measured);
        }
        if prediction.informed && first.is_ok() {
            return first;
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
        let sound = measured.agreement.overlap() >= LEAST_OVERLAP && measured.agreement.consent() >= LEAST_CONSENT;
        if contradicted && !(sound && measured.determined) {
            return Err(LossReason::LargeResiduals);
        }
        if measured.determined && (contradicted || !prediction.measured) {
            return Ok(half);
        }
        let pose = half.combined(&prediction.own).ok_or(LossReason::Undetermined)?;
        let share = if prediction.measured { 1.0 } else { BY_VELOCITY };
        let carried = pose.sigma_at(self.current.radius_m()) <= share * self.options.max_carried_sigma_m;
        if carried || measured.determined { Ok(pose) } else { Err(LossReason::Undetermined) }
    }
}

/// Registers a frame with another, near a guess.
fn register(
    aligner: &mut FrameAligner,
    options: &TrackerOptions,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    guess: &Isometry3<f64>,
) -> Result<Measured, LossReason> {
    let result = aligner.align(source, target, guess).map_err(|error| match error {
        Error::TooFewPoints { .. } => LossReason::TooFewPoints,
        Error::TooFewCorrespondences { .. } => LossReason::TooLittleOverlap,
        _ => LossReason::NotConverged,
    })?;
    let pose = Uncertain { pose: result.target_from_source, covariance: result.covariance };
    let agreement = target.agreement(source, &pose.pose, SAMPLE);
    if agreement.consent() < options.min_agreement {
        return Err(LossReason::LargeResiduals);
    }
    if agreement.overlap() < options.min_overlap {
        return Err(LossReason::TooLittleOverlap);
    }
    if !crate::pose::is_finite(&pose.pose) || pose.covariance.cholesky().is_none() {
        return Err(LossReason::NotConverged);
    }
    let determined = result.degenerate.is_empty();
    Ok(Measured { keyframe: 0, pose, determined, agreement, rms_m: result.rms_m })
}
