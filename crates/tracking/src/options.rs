//! What can be chosen in tracking.

use nalgebra::Isometry3;
use rigid_pose::{require_count, require_option, require_pose};

use crate::error::Result;
use projective_registration::FrameAlignmentOptions;

/// How the pose is sought after a loss.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Relocalisation {
    /// Only around the prediction, and from the poses of the keyframes that look most like the frame.
    Projective,
    /// Then also by alignment without a guess, with one keyframe a frame.
    #[default]
    Coarse,
    /// As [`Coarse`](Self::Coarse), for streams that do not wait: a lost frame is registered with two keyframes, other ones each time,
    /// and the alignment without a guess goes on beside the frames, on a thread of its own. What it finds serves the tenth frame
    /// behind the one that was aligned, which waits for it, so that the same frames give the same bits. Loops of a new keyframe are sought in
    /// the frames behind it, one in each, and closed with the last of them.
    Beside,
}

/// Length of the step, in standard deviations, after which the last one is taken. The pose of a quarter of the nodes lies √18
/// off that of all of them by noise alone, and each step is about a third of the one before: what is left after the last
/// one is below 0.5, where the noise of the pose is √6.
const NOISE_FRACTION: f64 = 4.0;

/// Options of a [`Tracker`](crate::Tracker). The defaults carry no scale.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerOptions {
    /// Registration of a frame with a keyframe. There is no search around the guess; where `max_motion_sigma_m` is `None`, it is 1/50 of the radius of
    /// the first frame. Default: that of [`FrameAlignmentOptions`] with the share of noise of a stream.
    pub alignment: FrameAlignmentOptions,
    /// Pose of the first frame: the datum, without error. Default: the identity.
    pub world_from_first: Isometry3<f64>,
    /// Another keyframe becomes the reference, or a new one is made, where a smaller fraction of the frame than this
    /// agrees with the present one. Default 0.7.
    pub keyframe_overlap: f64,
    /// Largest number of keyframes kept; beyond it the one that sees least of its own goes. Default 64.
    pub max_keyframes: usize,
    /// Older keyframes that each new one is registered with, those that should see most of the same first: what agrees with
    /// the path within its covariance closes a loop. 0: none, which saves that many registrations a keyframe. Default 4.
    pub loop_attempts: usize,
    /// How the pose is sought after a loss. Default: [`Relocalisation::Coarse`].
    pub relocalisation: Relocalisation,
}

impl Default for TrackerOptions {
    fn default() -> Self {
        Self {
            alignment: FrameAlignmentOptions {
                noise_fraction: Some(NOISE_FRACTION),
                ..FrameAlignmentOptions::default()
            },
            world_from_first: Isometry3::identity(),
            keyframe_overlap: 0.7,
            max_keyframes: 64,
            loop_attempts: 4,
            relocalisation: Relocalisation::Coarse,
        }
    }
}

impl TrackerOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        require_pose("world_from_first", &self.world_from_first)?;
        let is_share = |overlap| overlap > 0.0 && overlap < 1.0;
        require_option("keyframe_overlap", self.keyframe_overlap, "above 0 and below 1", is_share)?;
        Ok(require_count("max_keyframes", self.max_keyframes, 2)?)
    }
}
