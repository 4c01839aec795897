//! One frame against one keyframe, and the search among those nearby.

use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::motion_model::motion::diagonal;
use crate::motion_model::prediction::{Grounds, Last, Prediction};
use crate::motion_model::velocity::Velocity;
use crate::stream::keyframes::CANDIDATES;
use crate::stream::tracker::Tracker;
use crate::tracked::LossReason;
use pose_graph::{Relation, is_likely};
use projective_registration::icp_registration::quality::OPEN;
use projective_registration::{
    Agreement, ByField, Error as FrameError, Field, FrameAligner, Influence, OrganisedFrame,
};
use rigid_pose::{InputError, Uncertain, step_pose, symmetrised};

/// Share of the largest standard deviation of carried poses that is allowed where only the velocity carries them.
const BY_VELOCITY: f64 = 0.25;
/// Where a frame leaves motions undetermined, a prior or the velocity carries the pose: until its standard deviation at the
/// radius of the frame exceeds this, metre: half of the reach within which registrations of a room come back.
const CARRIED_SIGMA_M: f64 = 0.1;
/// Smallest fraction of the planes that the keyframe can judge that must agree: what frames of different places reach by chance.
const FEWEST_CONSENTING: f64 = 0.6;
/// Fraction of the frame that a pose found against expectation must agree by.
const LEAST_OVERLAP: f64 = 0.5;
/// Planes it must share: three make a corner, and corners look alike.
const LEAST_PLANES: usize = 4;
/// Share of the radius (and radian) by which a camera that starts or stops may miss the prediction, or go where its velocity is not known,
/// as a standard deviation: what is carried elsewhere is carried farther.
const JUMP: f64 = 0.05;

/// A registration that passed its tests.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measured {
    /// Index of the keyframe.
    pub(crate) keyframe: usize,
    /// Keyframe from camera, for the field that is assumed for the shared error; the covariance is of what is random.
    pub(crate) pose: Uncertain,
    /// The same as the frames were brought together.
    pub(crate) aligned: Isometry3<f64>,
    /// What the shared error does to it.
    pub(crate) influence: Option<Influence>,
    /// Whether the geometry determines all motions.
    pub(crate) determined: bool,
    pub(crate) agreement: Agreement,
    pub(crate) rms_m: f64,
}

impl Measured {
    /// Whether the geometry determines all motions well, and nothing speaks against the pose.
    fn is_firm(&self, radius_m: f64) -> bool {
        self.is_sound() && self.pose.sigma_at(radius_m) <= OPEN * radius_m
    }

    /// Whether the frames agree at the pose as they do at right ones. Frames that have slid along a wall fit as well, and
    /// can be as sure of it, but see through each other's surfaces.
    pub(crate) fn is_sound(&self) -> bool {
        self.determined && self.agrees()
    }

    /// Whether the frames contradict each other no more than at right poses.
    pub(crate) fn agrees(&self) -> bool {
        self.agreement.consent() >= Agreement::LEAST_CONSENT
    }

    /// The same with weak motions left open. What holds them are a few nodes, often at edges, and chance: their
    /// covariance promises too much.
    pub(crate) fn without_weak_motions(&self, radius_m: f64) -> Self {
        // Turns as distances at the radius.
        let scale = Matrix6::from_diagonal(&Vector6::new(1.0, 1.0, 1.0, radius_m, radius_m, radius_m));
        let back = Matrix6::from_diagonal(&scale.diagonal().map(|s| 1.0 / s));
        let mut motions = symmetrised(&(scale * self.pose.covariance * scale)).symmetric_eigen();
        for variance in motions.eigenvalues.iter_mut().filter(|v| **v > (OPEN * radius_m).powi(2)) {
            *variance = variance.max(radius_m * radius_m);
        }
        let covariance = symmetrised(&(back * motions.recompose() * back));
        Self { pose: Uncertain { covariance, ..self.pose }, determined: false, ..*self }
    }

    /// The part of the covariance that frames registered with the same keyframe do not share.
    pub(crate) fn own(&self) -> Uncertain {
        Uncertain { covariance: self.whole() * 0.5, ..self.pose }
    }

    /// The random covariance with all that the keyframe errs by: what residuals tell decides on what is determined alone.
    fn whole(&self) -> Matrix6<f64> {
        self.pose.covariance * self.influence.map_or(1.0, |influence| influence.kept)
    }

    /// Derivative of the pose by the field that is assumed.
    pub(crate) fn by_field(&self) -> ByField {
        self.influence.map_or_else(ByField::zeros, |influence| -influence.pose)
    }

    /// As an observation between the keyframe and the camera.
    pub(crate) fn relation(&self) -> Relation {
        Relation { random: Uncertain { covariance: self.whole(), ..self.pose }, by_field: self.by_field() }
    }

    /// The part that they share: the keyframe's own noise.
    pub(crate) fn shared(&self) -> Matrix6<f64> {
        self.whole() * 0.5
    }
}

/// Where a frame has been found.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fix {
    /// Keyframe from camera.
    pub(crate) own: Uncertain,
    pub(crate) velocity: Option<Velocity>,
    /// Whether it lies where the camera can have gone since the frame before.
    pub(crate) expected: bool,
}

impl Fix {
    /// Where nothing was expected.
    pub(crate) fn unexpected(measured: &Measured) -> Self {
        Self { own: measured.own(), velocity: None, expected: false }
    }
}

impl Tracker {
    /// Registers the current frame with keyframe `k`.
    pub(crate) fn try_keyframe(&mut self, k: usize, guess: &Isometry3<f64>) -> Result<Measured, LossReason> {
        let target = &self.keyframes.list[k].frame;
        register(&mut self.aligner, &self.current, target, guess, &self.keyframes.graph.field)
            .map(|measured| Measured { keyframe: k, ..measured })
    }

    /// The frame before as a new keyframe, where it determines what its own keyframe, with less in common, does not, or
    /// agrees where that one does not.
    pub(crate) fn with_previous(
        &mut self,
        last: &Last,
        prediction: &Prediction,
        helps: impl Fn(&Measured) -> bool,
    ) -> Option<Measured> {
        let exact = last.own.covariance == Matrix6::zeros();
        if last.lost_frames > 0 || exact {
            return None;
        }
        let guess = last.own.pose.inverse() * prediction.own.pose;
        let field = &self.keyframes.graph.field;
        let measured = register(&mut self.aligner, &self.current, &self.previous, &guess, field).ok()?;
        helps(&measured).then(|| {
            let total = Uncertain { covariance: last.own.covariance + last.shared, ..last.own };
            let relation = Relation { random: total, by_field: last.by_field };
            let keyframe = self.keyframes.add(&self.previous, last.keyframe, &relation);
            Measured { keyframe, ..measured }
        })
    }

    /// The keyframe that should see most of the frame, where it helps as a new one would: things that move contradict the reference, and
    /// without it a camera that stays in one room would make keyframes for ever.
    fn with_known(
        &mut self,
        last: &Last,
        prediction: &Prediction,
        helps: impl Fn(&Measured, &Prediction) -> bool,
    ) -> Option<Measured> {
        if last.lost_frames > 0 {
            return None;
        }
        let (reference, pose) = (last.keyframe, &prediction.own.pose);
        let &(overlap, k) = self.keyframes.candidates(&self.current, reference, pose, |k| k != reference).first()?;
        // With less in common, the next frames would leave it again.
        if overlap < self.options.keyframe_overlap {
            return None;
        }
        let predicted = prediction.seen_from(&self.keyframes.graph.relative(k, reference));
        self.try_keyframe(k, &predicted.own.pose).ok().filter(|measured| helps(measured, &predicted))
    }

    /// The current frame near its predicted pose: from the reference, or from keyframes that should see the same.
    pub(crate) fn near(&mut self, last: &Last, prediction: &Prediction) -> Result<Measured, LossReason> {
        let reference = last.keyframe;
        let first = self.try_keyframe(reference, &prediction.own.pose);
        let firm = first.as_ref().is_ok_and(|measured| measured.is_firm(self.current.radius_m()));
        let borne_out =
            first.as_ref().is_ok_and(|measured| measured.determined && prediction.bears_out(&measured.own()));
        if firm && (borne_out || prediction.grounds == Grounds::Nothing) {
            return first;
        }
        let radius = self.current.radius_m();
        let doubtful = !first.as_ref().is_ok_and(Measured::agrees);
        let helps = |measured: &Measured| measured.is_firm(radius) || doubtful && measured.is_sound();
        // Where the velocity bears the reference out, what contradicts moves by itself, and would draw another pose along; where it does not,
        // the reference may have been drawn along.
        let must_follow = firm || borne_out;
        let follows =
            |measured: &Measured, predicted: &Prediction| !must_follow || predicted.bears_out(&measured.own());
        if let Some(measured) = self.with_known(last, prediction, |m, predicted| helps(m) && follows(m, predicted)) {
            return Ok(measured);
        }
        let from_previous = prediction.seen_from(&last.own.pose.inverse());
        if let Some(measured) = self.with_previous(last, prediction, |m| helps(m) && follows(m, &from_previous)) {
            return Ok(measured);
        }
        let usable = |measured: &Measured| measured.determined || prediction.grounds != Grounds::Nothing;
        if first.as_ref().is_ok_and(|measured| usable(measured) && measured.agrees()) {
            return first;
        }
        let others = |k: usize| k != reference;
        let pose = &prediction.own.pose;
        let candidates = self.keyframes.candidates(&self.current, reference, pose, others);
        // In a stream that does not wait, a lost frame tries one of them, in turn.
        let one = self.is_beside() && last.lost_frames > 0;
        let (passed, tried) = if one { (last.lost_frames % CANDIDATES, 1) } else { (0, CANDIDATES) };
        for (_, k) in candidates.into_iter().skip(passed).take(tried) {
            let predicted = prediction.seen_from(&self.keyframes.graph.relative(k, reference));
            if let Ok(measured) = self.try_keyframe(k, &predicted.own.pose)
                && measured.is_sound()
                && follows(&measured, &predicted)
            {
                return Ok(measured);
            }
        }
        match first {
            Ok(measured) if usable(&measured) => first,
            Ok(_) => Err(LossReason::Undetermined),
            Err(reason) => Err(reason),
        }
    }

    /// The pose by a registration and the prediction, and the registration as it was used: motions that it determines
    /// weakly are left to the prediction as far as that one carries.
    pub(crate) fn fixed(
        &self,
        measured: &Measured,
        prediction: &Prediction,
        lost_frames: usize,
    ) -> Result<(Measured, Fix), LossReason> {
        let radius = self.current.radius_m();
        if !measured.is_firm(radius) && prediction.grounds != Grounds::Nothing {
            let cautious = measured.without_weak_motions(radius);
            if let Ok(fix) = self.weighted(&cautious, prediction, lost_frames) {
                return Ok((cautious, fix));
            }
        }
        Ok((*measured, self.weighted(measured, prediction, lost_frames)?))
    }

    /// The pose from a registration and a prediction with its covariance: both are weighted, and what the geometry
    /// leaves open stays with the prediction. Far from the prediction, a pose must stand on its own.
    ///
    /// Half of the covariance of the registration is the keyframe's noise, which all frames registered with it share;
    /// only the other half averages out with the prediction.
    fn weighted(&self, measured: &Measured, prediction: &Prediction, lost_frames: usize) -> Result<Fix, LossReason> {
        let half = measured.own();
        let expected = self.expects(&half, prediction, lost_frames);
        if !expected || prediction.grounds == Grounds::Nothing {
            if !measured.determined {
                return Err(LossReason::Undetermined);
            }
            let fix = Fix { own: half, velocity: None, expected };
            return if expected || self.stands_alone(measured) { Ok(fix) } else { Err(LossReason::LargeResiduals) };
        }
        let (own, velocity) = prediction.corrected(&half).ok_or(LossReason::Undetermined)?;
        let carried = own.sigma_at(self.current.radius_m()) <= Self::carried_sigma_m(prediction.grounds);
        let fix = Fix { own, velocity, expected: true };
        if carried || measured.determined { Ok(fix) } else { Err(LossReason::Undetermined) }
    }

    /// Whether a pose lies where the camera can have gone since the frame before.
    fn expects(&self, own: &Uncertain, prediction: &Prediction, lost_frames: usize) -> bool {
        let radius = self.current.radius_m();
        let ungrounded = prediction.grounds == Grounds::Nothing;
        let known = if ungrounded { Matrix6::zeros() } else { prediction.own.covariance };
        let covariance = known + diagonal([(JUMP * radius).powi(2), JUMP * JUMP]);
        let reachable = Uncertain { covariance, ..prediction.own };
        let relied_on = !ungrounded && prediction.own.sigma_at(radius) <= Self::carried_sigma_m(prediction.grounds);
        (lost_frames == 0 || relied_on) && own.mahalanobis_squared(&reachable).is_some_and(is_likely)
    }

    fn carried_sigma_m(grounds: Grounds) -> f64 {
        let share = if grounds == Grounds::Prior { 1.0 } else { BY_VELOCITY };
        share * CARRIED_SIGMA_M
    }

    /// Whether a pose would be believed wherever it was found: each frame agrees with what the other saw and with the
    /// space that it looked through, and what they share is found at one place only.
    pub(crate) fn stands_alone(&self, measured: &Measured) -> bool {
        let keyframe = &self.keyframes.list[measured.keyframe].frame;
        let pose = &measured.aligned;
        let sound = |a: &Agreement| a.overlap() >= LEAST_OVERLAP && a.consent() >= Agreement::LEAST_CONSENT;
        measured.determined
            && sound(&measured.agreement)
            && self.current.agreement(keyframe, &pose.inverse(), Agreement::NODES).consent() >= Agreement::LEAST_CONSENT
            && keyframe.shared_planes(&self.current, pose, Agreement::NODES) >= LEAST_PLANES
    }
}

/// Registers a frame with another, near a guess; the pose is corrected by the field that is assumed.
pub(crate) fn register(
    aligner: &mut FrameAligner,
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    guess: &Isometry3<f64>,
    field: &Field,
) -> Result<Measured, LossReason> {
    let (result, influence) = aligner.align_apart(source, target, guess).map_err(|error| match error {
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
