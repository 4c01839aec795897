//! One frame against one keyframe, and the search among those nearby.

use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::motion_model::prediction::{Grounds, Last, Prediction};
use crate::motion_model::velocity::Velocity;
use crate::stream::claim::{Claim, reachable};
use crate::stream::keyframes::CANDIDATES;
use crate::stream::register::{contradict, register, register_expected};
use crate::stream::tracker::Tracker;
use crate::tracked::LossReason;
use pose_graph::{Relation, is_likely};
use projective_registration::icp_registration::quality::OPEN;
use projective_registration::{Agreement, ByField, Influence};
use rigid_pose::{Uncertain, symmetrised};

/// Share of the largest standard deviation of carried poses that is allowed where only the velocity carries them.
const BY_VELOCITY: f64 = 0.25;
/// Where a frame leaves motions undetermined, a prior or the velocity carries the pose: until its standard deviation at the
/// radius of the frame exceeds this, metre: half of the reach within which registrations of a room come back.
const CARRIED_SIGMA_M: f64 = 0.1;
/// Fraction of the frame that a pose found against expectation must agree by.
const LEAST_OVERLAP: f64 = 0.5;
/// Planes it must share: three make a corner, and corners look alike.
const LEAST_PLANES: usize = 4;

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
    pub(crate) fn is_firm(&self, radius_m: f64) -> bool {
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

    /// Whether it lies farther from a pose `reference_from_camera` than both let expect.
    pub(crate) fn contradicts(&self, other: &Uncertain, keyframe_from_reference: &Isometry3<f64>) -> bool {
        contradict(&self.own(), &Uncertain::exact(*keyframe_from_reference).then(other))
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
    /// Whether the registration by itself lies where the velocity, or a measurement of the motion, expects the camera.
    pub(crate) borne_out: bool,
}

impl Fix {
    /// Where nothing was expected.
    pub(crate) fn unexpected(measured: &Measured) -> Self {
        Self { own: measured.own(), velocity: None, expected: false, borne_out: false }
    }
}

impl Tracker {
    /// Registers the current frame with keyframe `k`.
    pub(crate) fn try_keyframe(&mut self, k: usize, guess: &Isometry3<f64>) -> Result<Measured, LossReason> {
        let target = &self.keyframes.list[k].frame;
        register(&mut self.aligner, &self.current, target, guess, &self.keyframes.graph.field)
            .map(|measured| Measured { keyframe: k, ..measured })
    }

    /// Registers the current frame with keyframe `k`, from which it is expected somewhere.
    fn try_expected(&mut self, k: usize, prediction: &Prediction) -> Result<Measured, LossReason> {
        let (target, field) = (&self.keyframes.list[k].frame, &self.keyframes.graph.field);
        register_expected(&mut self.aligner, &self.current, target, prediction, field)
            .map(|measured| Measured { keyframe: k, ..measured })
    }

    /// The current frame and the one before, which is no keyframe yet.
    pub(crate) fn try_previous(&mut self, last: &Last, prediction: &Prediction) -> Option<Measured> {
        let exact = last.own.covariance == Matrix6::zeros();
        if last.lost_frames > 0 || exact {
            return None;
        }
        let (expected, field) = (prediction.seen_from(&last.own.pose.inverse()), &self.keyframes.graph.field);
        register_expected(&mut self.aligner, &self.current, &self.previous, &expected, field).ok()
    }

    /// Makes the frame before a keyframe, with which the current one has been registered.
    pub(crate) fn keep_previous(&mut self, last: &Last, measured: &Measured) -> Measured {
        let total = Uncertain { covariance: last.own.covariance + last.shared, ..last.own };
        let relation = Relation { random: total, by_field: last.by_field };
        let keyframe = self.keyframes.add(&self.previous, last.keyframe, &relation);
        Measured { keyframe, ..*measured }
    }

    /// The current frame and the keyframe of a candidate, where they are brought together as the reference lets expect.
    fn try_candidate(&mut self, k: usize, last: &Last, prediction: &Prediction, claim: &Claim) -> Option<Measured> {
        let between = self.keyframes.graph.relative(k, last.keyframe);
        let found = self.try_keyframe(k, &(between * prediction.own.pose)).ok();
        found.filter(|measured| claim.is_met_by(measured, &between))
    }

    /// Whether surfaces lie on each other better with the frame before than with the reference, where the poses contradict each other. (Of a
    /// keyframe that is there already that is not asked: its planes are known better than those of a frame, and lie worse for it.)
    fn previous_lies_better(
        &mut self,
        first: Option<&Measured>,
        previous: &Measured,
        previous_from_reference: &Isometry3<f64>,
    ) -> bool {
        let denied =
            |first: &&Measured| first.determined && previous.contradicts(&first.own(), previous_from_reference);
        let Some(first) = first.filter(denied) else { return true };
        let reference = &self.keyframes.list[first.keyframe].frame;
        let mut off = |frame, measured: &Measured| self.aligner.misfit(&self.current, frame, &measured.aligned);
        off(&self.previous, previous).zip(off(reference, first)).is_some_and(|(off, of_reference)| off < of_reference)
    }

    /// The current frame near its predicted pose: from the reference, or from keyframes that should see the same.
    pub(crate) fn near(&mut self, last: &Last, prediction: &Prediction) -> Result<Measured, LossReason> {
        let reference = last.keyframe;
        let first = self.try_expected(reference, prediction);
        let claim = Claim::of(first.as_ref().ok(), prediction, self.current.radius_m());
        if claim.is_settled {
            return first;
        }
        let others = |k: usize| k != reference;
        let candidates = self.keyframes.candidates(&self.current, reference, &prediction.own.pose, others);
        // One that is there goes before a new one: things that move contradict the reference, and a camera that stays in one room would
        // make keyframes for ever. With less in common, the next frames would leave it again.
        let shared = |overlap: f64| last.lost_frames == 0 && overlap >= self.options.keyframe_overlap;
        let known = candidates.first().filter(|(overlap, _)| shared(*overlap)).map(|&(_, k)| k);
        let of_known = known.map(|k| self.try_candidate(k, last, prediction, &claim));
        if let Some(Some(measured)) = of_known.filter(|found| found.is_some_and(|m| claim.is_helped_by(&m))) {
            return Ok(measured);
        }
        let from_previous = last.own.pose.inverse();
        let helps = |measured: &Measured| claim.is_helped_by(measured) && claim.is_met_by(measured, &from_previous);
        let previous = self.try_previous(last, prediction).filter(helps);
        if let Some(measured) = previous.filter(|m| self.previous_lies_better(first.as_ref().ok(), m, &from_previous)) {
            return Ok(self.keep_previous(last, &measured));
        }
        if first.as_ref().is_ok_and(|measured| claim.is_usable(measured) && measured.agrees()) {
            return first;
        }
        // In a stream that does not wait, a lost frame tries one of them, in turn.
        let one = self.is_beside() && last.lost_frames > 0;
        let (passed, tried) = if one { (last.lost_frames % CANDIDATES, 1) } else { (0, CANDIDATES) };
        let sound = candidates.into_iter().skip(passed).take(tried).find_map(|(_, k)| {
            let again = of_known.filter(|_| known == Some(k));
            again.unwrap_or_else(|| self.try_candidate(k, last, prediction, &claim)).filter(Measured::is_sound)
        });
        match (sound, first) {
            (Some(measured), _) => Ok(measured),
            (None, Ok(measured)) if !claim.is_usable(&measured) => Err(LossReason::Undetermined),
            (None, first) => first,
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
            let fix = Fix { own: half, velocity: None, expected, borne_out: false };
            return if expected || self.stands_alone(measured) { Ok(fix) } else { Err(LossReason::LargeResiduals) };
        }
        let (own, velocity) = prediction.corrected(&half).ok_or(LossReason::Undetermined)?;
        let carried = own.sigma_at(self.current.radius_m()) <= Self::carried_sigma_m(prediction.grounds);
        let fix = Fix { own, velocity, expected: true, borne_out: prediction.bears_out(&half) };
        if carried || measured.determined { Ok(fix) } else { Err(LossReason::Undetermined) }
    }

    /// Whether a pose lies where the camera can have gone since the frame before.
    fn expects(&self, own: &Uncertain, prediction: &Prediction, lost_frames: usize) -> bool {
        let radius = self.current.radius_m();
        let grounded = prediction.grounds != Grounds::Nothing;
        let relied_on = grounded && prediction.own.sigma_at(radius) <= Self::carried_sigma_m(prediction.grounds);
        let reachable = reachable(prediction, radius);
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
