//! Where the next frame is expected.

use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3};

use crate::motion_model::motion::MotionPrior;
use crate::motion_model::velocity::Velocity;
use pose_graph::is_likely;
use projective_registration::ByField;
use rigid_pose::Uncertain;
use rigid_pose::pose_difference;

/// Intervals of the frames that the last velocity was had from for which it is carried on: lost frames, or a gap between two.
const CARRIED: usize = 5;
/// Weight of the latest frame in the mean disturbance.
const LATEST: f64 = 0.2;
/// Smallest disturbance, as a change of the motion from one frame to the next, relative to that motion.
const LEAST_CHANGE: f64 = 0.05;

/// What is kept of the frame before.
#[derive(Debug, Clone)]
pub(crate) struct Last {
    pub(crate) timestamp_s: f64,
    /// Index of the keyframe.
    pub(crate) keyframe: usize,
    /// Keyframe from camera, with the part of the covariance that this frame does not share with others.
    pub(crate) own: Uncertain,
    /// Its derivative by the field that is assumed for the shared error.
    pub(crate) by_field: ByField,
    /// The part that all frames registered with this keyframe share: the keyframe's own noise.
    pub(crate) shared: Matrix6<f64>,
    pub(crate) velocity: Option<Velocity>,
    /// Time between the last two frames that followed each other, second.
    pub(crate) interval_s: f64,
    /// Spectral densities of the acceleration, m²/s³ and rad²/s³ per axis.
    pub(crate) disturbance: Option<[f64; 2]>,
    /// Frames since the geometry determined all motions.
    pub(crate) carried: usize,
    /// Whether `own` has a covariance that can be relied on: tracked, or carried by priors since.
    pub(crate) informed: bool,
    /// Frames since the last one with a pose.
    pub(crate) lost_frames: usize,
}

/// What a prediction rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grounds {
    /// It is but a start: the covariance means nothing.
    Nothing,
    /// Constant velocity.
    Velocity,
    /// A measurement of the motion.
    Prior,
}

/// The pose a frame is expected at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prediction {
    pub(crate) own: Uncertain,
    pub(crate) velocity: Option<Velocity>,
    pub(crate) grounds: Grounds,
}

impl Prediction {
    /// Whether a measured pose lies as near to the predicted one as the deviations of both let expect; never where the prediction is but
    /// a start.
    pub(crate) fn bears_out(&self, measured: &Uncertain) -> bool {
        self.grounds != Grounds::Nothing && measured.mahalanobis_squared(&self.own).is_some_and(is_likely)
    }

    /// The prediction corrected by a measurement. Where the camera moved in another way than predicted, the prediction
    /// counts for less.
    pub(crate) fn corrected(&self, measured: &Uncertain) -> Option<(Uncertain, Option<Velocity>)> {
        // Six is the mean.
        let factor = (measured.mahalanobis_squared(&self.own)? / 6.0).max(1.0);
        let own = Uncertain { covariance: self.own.covariance * factor, ..self.own };
        match &self.velocity {
            Some(velocity) => {
                velocity.loosened(factor).correct(&own, measured).map(|(pose, velocity)| (pose, Some(velocity)))
            }
            None => Some((own.combined(measured)?, None)),
        }
    }

    /// The same in the frame of another keyframe `a`.
    pub(crate) fn seen_from(&self, a_from_b: &Isometry3<f64>) -> Self {
        let between = Uncertain::exact(*a_from_b);
        let velocity = self.velocity.map(|velocity| velocity.seen_from(&between, &self.own));
        Self { own: between.then(&self.own), velocity, ..*self }
    }
}

impl Last {
    pub(crate) fn predict(&self, timestamp_s: f64, prior: Option<&MotionPrior>) -> Prediction {
        let turn = prior.and_then(MotionPrior::turn);
        if let Some(prior) = prior.filter(|_| turn.is_none()) {
            let mut motion = prior.previous_from_current();
            // Errors of successive priors have their cause in common (a velocity, a bias), so that they add up.
            motion.covariance *= 2.0 * self.carried as f64 + 1.0;
            let grounds = if self.informed { Grounds::Prior } else { Grounds::Nothing };
            return Prediction { own: self.own.then(&motion), velocity: None, grounds };
        }
        let seconds = timestamp_s - self.timestamp_s;
        // A frame that came much later than the ones before says nothing about where the camera went.
        let bridged = self.lost_frames < CARRIED && seconds <= CARRIED as f64 * self.interval_s;
        let Some(velocity) = self.velocity.filter(|_| bridged) else {
            let motion = turn.map_or_else(
                || Uncertain::exact(Isometry3::identity()),
                |(turn, covariance)| turned(turn, &covariance),
            );
            return Prediction { own: self.own.then(&motion), velocity: None, grounds: Grounds::Nothing };
        };
        let [shift, swing] = self.disturbance.unwrap_or_default();
        // What is measured of the rotation is its mean over the interval: no disturbance adds to that.
        let (velocity, disturbance) = match turn {
            Some((turn, covariance)) => {
                (velocity.turning(&(turn.scaled_axis() / seconds), &(covariance / (seconds * seconds))), [shift, 0.0])
            }
            None => (velocity, [shift, swing]),
        };
        let (own, velocity) = velocity.predict(&self.own, seconds, disturbance);
        let known = self.informed && self.disturbance.is_some();
        let grounds = if known { Grounds::Velocity } else { Grounds::Nothing };
        Prediction { own, velocity: Some(velocity), grounds }
    }

    /// The mean disturbance after a frame that was determined, by how far it came to lie beside its prediction.
    pub(crate) fn disturbed_by(
        &self,
        timestamp_s: f64,
        prediction: &Prediction,
        measured: &Uncertain,
        motion: &Isometry3<f64>,
    ) -> Option<[f64; 2]> {
        if prediction.velocity.is_none() || self.carried > 0 {
            return self.disturbance;
        }
        let gap = pose_difference(&prediction.own.pose, &measured.pose);
        let moved = [motion.translation.vector.norm(), motion.rotation.angle()];
        let seconds = timestamp_s - self.timestamp_s;
        let latest = [0, 1].map(|i| {
            let noise = measured.covariance.fixed_view::<3, 3>(3 * i, 3 * i).trace();
            let square = gap.fixed_rows::<3>(3 * i).norm_squared() - noise;
            // White noise of density q moves each of three axes by q t³/3 in the mean square.
            square.max((LEAST_CHANGE * moved[i]).powi(2)) / seconds.powi(3)
        });
        let mean = self.disturbance.unwrap_or(latest);
        Some([0, 1].map(|i| mean[i] + LATEST * (latest[i] - mean[i])))
    }
}

/// A motion on the spot.
fn turned(turn: UnitQuaternion<f64>, covariance: &Matrix3<f64>) -> Uncertain {
    let mut whole = Matrix6::zeros();
    whole.fixed_view_mut::<3, 3>(3, 3).copy_from(covariance);
    Uncertain { pose: Isometry3::from_parts(Vector3::zeros().into(), turn), covariance: whole }
}
