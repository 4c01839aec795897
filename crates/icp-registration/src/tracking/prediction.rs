//! Where the next frame is expected.

use nalgebra::{Isometry3, Matrix6};

use super::motion::{MotionPrior, Uncertain, scaled};

/// Frames after a loss for which the last velocity is carried on.
const CARRIED_FRAMES: usize = 5;

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
}

impl Last {
    pub(super) fn predict(&self, timestamp_s: f64, prior: Option<&MotionPrior>) -> Prediction {
        if let Some(prior) = prior {
            let own = self.own.then(&prior.previous_from_current());
            return Prediction { own, informed: self.informed };
        }
        let motion = match self.velocity {
            Some((motion, seconds)) if self.lost_frames < CARRIED_FRAMES => {
                scaled(&motion, (timestamp_s - self.timestamp_s) / seconds)
            }
            _ => Isometry3::identity(),
        };
        // A frame that came much later than the ones before says nothing about where the camera went.
        let far = motion.translation.vector.norm() > 1e3;
        let motion = if far { Isometry3::identity() } else { motion };
        Prediction { own: self.own.then(&Uncertain::exact(motion)), informed: false }
    }
}
