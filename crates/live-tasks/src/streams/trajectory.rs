//! Poses one after the other.

use std::io::{Result, Write};

use live_frames::camera_model::with_computer_vision_axes;
use live_frames::tracking::TrackedPose;
use live_frames::tracking::nalgebra::Isometry3;

/// Writer of a trajectory, line by line as frames come: `timestamp tx ty tz qx qy qz qw` (TUM), camera to world, computer-vision
/// axes, every number with the digits that give it back. A frame without a pose has no line.
#[derive(Debug)]
pub struct TrajectoryStream<W> {
    writer: W,
}

impl<W: Write> TrajectoryStream<W> {
    /// A stream that goes to a writer.
    pub fn new(writer: W) -> Self {
        Self { writer }
    }

    /// Writes a pose, where it is one.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write(&mut self, pose: &TrackedPose) -> Result<()> {
        if !pose.state.has_pose() {
            return Ok(());
        }
        let [tx, ty, tz, qx, qy, qz, qw] = pose_numbers(&pose.world_from_camera);
        writeln!(self.writer, "{} {tx} {ty} {tz} {qx} {qy} {qz} {qw}", pose.timestamp_s)?;
        self.writer.flush()
    }

    /// The writer.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// A pose as in a line of a trajectory: `tx ty tz qx qy qz qw`, computer-vision axes.
pub(crate) fn pose_numbers(world_from_camera: &Isometry3<f64>) -> [f64; 7] {
    let Isometry3 { rotation: q, translation: t } = with_computer_vision_axes(world_from_camera);
    [t.x, t.y, t.z, q.i, q.j, q.k, q.w]
}
