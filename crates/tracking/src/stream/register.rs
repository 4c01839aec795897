//! Two frames brought together, and which of two poses is that of what stands still.

use nalgebra::Isometry3;

use crate::motion_model::prediction::Prediction;
use crate::stream::locate::Measured;
use crate::tracked::LossReason;
use pose_graph::is_likely;
use projective_registration::icp_registration::IcpResult;
use projective_registration::{
    Agreement, ByField, Error as FrameError, Field, FrameAligner, Influence, OrganisedFrame,
};
use rigid_pose::{InputError, Uncertain, step_pose};

/// Smallest fraction of the planes that the keyframe can judge that must agree: what frames of different places reach by chance.
const FEWEST_CONSENTING: f64 = 0.6;

/// What the misfits of two poses, medians over some 400 cells, differ by once in a thousand times by chance: `1 + 3.1 sqrt(2) 1.17 / sqrt(400)`,
/// where 1.17 is the relative standard deviation of the median size of a normal value, times the root of their number. With 1.0 one frame is
/// lost without need in ten streams; 1.0 and 1.25 find the same wrong poses (at least 1.6).
const BEYOND_CHANCE: f64 = 1.25;

/// Registers a frame with another from where the camera is expected. What is in reach of that all takes part first, and something large
/// that moves by itself may draw the pose along: where the prediction does not bear out what comes of it, the frames are brought together
/// without what strays at the prediction, too, and of poses that contradict each other the one at which surfaces lie on each other better
/// is taken; a pose with a motion open where only what strays determines it.
pub(crate) fn register_expected(
    aligner: &mut FrameAligner,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    prediction: &Prediction,
    field: &Field,
) -> Result<Measured, LossReason> {
    let guess = &prediction.own.pose;
    let first = register(aligner, source, target, guess, field);
    let borne_out = |measured: &Measured| measured.determined && prediction.bears_out(&measured.own());
    if first.as_ref().is_ok_and(borne_out) {
        return first;
    }
    let Ok(near) = judged(aligner.align_near(source, target, guess), source, target, field) else { return first };
    let is_better = match &first {
        Ok(first) if first.determined => lies_better(aligner, source, target, &near, first),
        _ => borne_out(&near),
    };
    if is_better { Ok(near) } else { first }
}

/// Whether surfaces lie on each other better at another pose that contradicts the first one, or leaves open what the first one determines:
/// what strays alone did so.
fn lies_better(
    aligner: &mut FrameAligner,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    other: &Measured,
    first: &Measured,
) -> bool {
    if other.determined && !contradict(&other.own(), &first.own()) {
        return false;
    }
    let clearly = if other.determined { 1.0 } else { BEYOND_CHANCE };
    let mut off = |measured: &Measured| aligner.misfit(source, target, &measured.aligned);
    off(other).zip(off(first)).is_some_and(|(other, first)| clearly * other < first)
}

/// Whether two poses lie farther from each other than their covariances let expect.
pub(crate) fn contradict(a: &Uncertain, b: &Uncertain) -> bool {
    !a.mahalanobis_squared(b).is_some_and(is_likely)
}

/// Registers a frame with another, near a guess; the pose is corrected by the field that is assumed.
pub(crate) fn register(
    aligner: &mut FrameAligner,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    guess: &Isometry3<f64>,
    field: &Field,
) -> Result<Measured, LossReason> {
    judged(aligner.align_apart(source, target, guess), source, target, field)
}

/// A registration that passes its tests.
fn judged(
    result: Result<(IcpResult, Option<Influence>), FrameError>,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    field: &Field,
) -> Result<Measured, LossReason> {
    let (result, influence) = result.map_err(|error| match error {
        FrameError::Input(InputError::TooFewPoints { .. }) => LossReason::TooFewPoints,
        FrameError::Input(InputError::TooFewCorrespondences { .. }) => LossReason::TooLittleOverlap,
        _ => LossReason::NotConverged,
    })?;
    let aligned = result.target_from_source;
    let by_field = influence.map_or_else(ByField::zeros, |influence| influence.pose);
    let pose = Uncertain { pose: step_pose(&aligned, &(-by_field * field)), covariance: result.covariance };
    let agreement = target.agreement(source, &aligned, Agreement::NODES);
    if agreement.consent() < FEWEST_CONSENTING {
        return Err(LossReason::LargeResiduals);
    }
    if agreement.overlap() < Agreement::LEAST_OVERLAP {
        return Err(LossReason::TooLittleOverlap);
    }
    if !rigid_pose::is_finite(&pose.pose) || pose.covariance.cholesky().is_none() {
        return Err(LossReason::NotConverged);
    }
    let determined = result.degenerate.is_empty();
    Ok(Measured { keyframe: 0, pose, aligned, influence, determined, agreement, rms_m: result.rms_m })
}
