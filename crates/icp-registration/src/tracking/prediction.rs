//! Where the next frame is expected.

use nalgebra::{Isometry3, Matrix6, Vector6};

use super::motion::{MotionPrior, Uncertain, scaled};
use crate::pose::pose_difference;

/// Frames after a loss for which the last velocity is carried on.
const CARRIED_FRAMES: usize = 5;

/// Longest gap that the last velocity bridges, in intervals of the frames it was had from.
const MOST_INTERVALS: f64 = 5.0;

/// What is kept of the frame before.
#[derive(Debug, Clone)]
pub(super) struct Last {
    pub(super) timestamp_s: f64,
    /// Index of the keyframe.
    pub(super) keyframe: usize,
    /// Keyframe from camera, with the part of the covariance that this frame does not share with others.
    pub(super) own: Uncertain,
    /// The part that all frames registered with this keyframe share: the keyframe's own noise.
    pub(super) shared: Matrix6<f64>,
    /// Motion of the last interval (previous from current) and its length, second.
    pub(super) velocity: Option<(Isometry3<f64>, f64)>,
    /// How far frames came to lie beside the prediction at constant velocity: mean squares, metre² and radian².
    pub(super) surprise: Option<[f64; 2]>,
    /// Frames since the geometry determined all motions.
    pub(super) carried: usize,
    /// Whether `own` has a covariance that can be relied on: tracked, or carried by priors since.
    pub(super) informed: bool,
    /// Frames since the last one with a pose.
    pub(super) lost_frames: usize,
}

/// The pose a frame is expected at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prediction {
    pub(super) own: Uncertain,
    /// Whether its covariance can be relied on.
    pub(super) informed: bool,
    /// Whether it was measured: constant velocity is only for what the frame leaves open.
    pub(super) measured: bool,
}

/// Weight of the latest frame in the mean surprise.
const LATEST: f64 = 0.2;

impl Last {
    pub(super) fn predict(&self, timestamp_s: f64, prior: Option<&MotionPrior>) -> Prediction {
        let frames = self.carried as f64;
        if let Some(prior) = prior {
            let mut motion = prior.previous_from_current();
            // Errors of successive priors have their cause in common (a velocity, a bias), so that they add up.
            motion.covariance *= 2.0 * frames + 1.0;
            return Prediction { own: self.own.then(&motion), informed: self.informed, measured: true };
        }
        let Some(motion) = self.motion(timestamp_s) else {
            return Prediction { own: self.own, informed: false, measured: false };
        };
        // The velocity itself goes astray: displacements grow with the power 3/2 of time, their squares with the third.
        let [shift, turn] = self.surprise.unwrap_or_default().map(|square| square * (frames + 1.0).powi(2));
        let covariance = Matrix6::from_diagonal(&Vector6::new(shift, shift, shift, turn, turn, turn));
        let own = self.own.then(&Uncertain { pose: motion, covariance });
        let informed = self.informed && self.lost_frames == 0 && self.surprise.is_some();
        Prediction { own, informed, measured: false }
    }

    /// Motion until then at constant velocity, previous from current.
    fn motion(&self, timestamp_s: f64) -> Option<Isometry3<f64>> {
        let (motion, seconds) = self.velocity.filter(|_| self.lost_frames < CARRIED_FRAMES)?;
        // A frame that came much later than the ones before says nothing about where the camera went.
        let intervals = (timestamp_s - self.timestamp_s) / seconds;
        (intervals <= MOST_INTERVALS).then(|| scaled(&motion, intervals))
    }

    /// The mean surprise after a frame that was determined, and lies at `own` with the frame before at `before`.
    pub(super) fn surprise_by(
        &self,
        timestamp_s: f64,
        before: &Isometry3<f64>,
        own: &Isometry3<f64>,
    ) -> Option<[f64; 2]> {
        let Some(motion) = self.motion(timestamp_s).filter(|_| self.carried == 0) else { return self.surprise };
        let gap = pose_difference(&(before * motion), own);
        let latest = [0, 3].map(|at| gap.fixed_rows::<3>(at).norm_squared() / 3.0);
        let mean = self.surprise.unwrap_or(latest);
        Some([0, 1].map(|i| mean[i] + LATEST * (latest[i] - mean[i])))
    }
}
