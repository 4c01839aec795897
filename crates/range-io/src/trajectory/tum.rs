use std::fmt::Write;
use std::path::Path;

use camera_model::with_computer_vision_axes;
use nalgebra::Isometry3;

use super::fields::Line;
use super::{StampedPose, write_lines};
use crate::Result;
use crate::read_text;

/// Reads a TUM trajectory: `timestamp tx ty tz qx qy qz qw`, lines that begin with `#` are comments.
pub fn read_tum(path: impl AsRef<Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    let text = read_text(path)?;
    Line::all(path, &text).map(pose).collect()
}

fn pose(line: Line<'_>) -> Result<StampedPose> {
    let values = line.numbers(["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"])?;
    let [timestamp_s, tx, ty, tz, qx, qy, qz, qw] = values;
    let world_from_camera = line.pose([tx, ty, tz], [qx, qy, qz, qw], 5, "qx qy qz qw")?;
    Ok(StampedPose { timestamp_s, world_from_camera })
}

/// Writes a TUM trajectory, one blank between fields, every number with the digits that give it back.
pub fn write_tum(path: impl AsRef<Path>, poses: &[StampedPose]) -> Result<()> {
    write_lines(path.as_ref(), "", poses, |pose, line| {
        let Isometry3 { rotation: q, translation: t } = with_computer_vision_axes(&pose.world_from_camera);
        write!(line, "{} {} {} {} {} {} {} {}", pose.timestamp_s, t.x, t.y, t.z, q.i, q.j, q.k, q.w)
    })
}
