use std::path::Path;

use super::StampedPose;
use super::fields::{Line, matrix_of_lines};
use crate::Result;
use crate::read_text;

/// Reads a Redwood log: for each pose a line of three whole numbers and a 4x4 camera-to-world matrix.
///
/// The first of the three numbers, that of the frame, stands for the time.
pub fn read_redwood_log(path: impl AsRef<Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    let text = read_text(path)?;
    let mut lines = Line::all(path, &text);
    let mut poses = Vec::new();
    while let Some(line) = lines.next() {
        let [timestamp_s, ..] = line.numbers(["first frame", "second frame", "frames"])?;
        poses.push(StampedPose { timestamp_s, world_from_camera: matrix_of_lines(&mut lines, line)? });
    }
    Ok(poses)
}
