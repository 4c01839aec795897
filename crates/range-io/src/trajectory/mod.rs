//! Trajectories: TUM, KITTI and `EuRoC` text files, read and written; Redwood logs and 7-Scenes folders, read.
//!
//! Poses in memory have photogrammetric camera axes, poses in these files computer-vision axes; the turn happens here and
//! only here, by [`camera_model::with_computer_vision_axes`]. The world stays as it is.

mod any;
mod euroc;
mod fields;
mod kitti;
mod matrix;
mod redwood;
mod sevenscenes;
mod tum;

use std::path::Path;

use nalgebra::Isometry3;

use crate::{Error, Result};

pub use any::{TrajectoryFormat, read_any_trajectory, write_any_trajectory};
pub use euroc::{read_euroc, write_euroc};
pub use kitti::{read_kitti, write_kitti};
pub use matrix::read_matrix;
pub use redwood::read_redwood_log;
pub use sevenscenes::read_pose_folder;
pub use tum::{read_tum, write_tum};

/// A pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedPose {
    /// Time in seconds; in formats without times the number of the frame.
    pub timestamp_s: f64,
    /// Pose, photogrammetric camera axes.
    pub world_from_camera: Isometry3<f64>,
}

fn write_lines(
    path: &Path,
    header: &str,
    poses: &[StampedPose],
    line: impl Fn(&StampedPose, &mut String) -> std::fmt::Result,
) -> Result<()> {
    let mut text = header.to_owned();
    for (index, pose) in poses.iter().enumerate() {
        let finite = pose.timestamp_s.is_finite()
            && pose.world_from_camera.translation.vector.iter().all(|value| value.is_finite())
            && pose.world_from_camera.rotation.coords.iter().all(|value| value.is_finite());
        // Writing to a string fails only if a number's own formatting does.
        if !finite || line(pose, &mut text).is_err() {
            let field = format!("[{index}]");
            return Err(Error::Value { what: "trajectory", field, reason: "is not finite".into() });
        }
        text.push('\n');
    }
    Ok(atomic_output::write_text(path, &text)?)
}
