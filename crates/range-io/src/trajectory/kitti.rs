use std::fmt::Write;
use std::path::Path;

use camera_model::with_computer_vision_axes;

use super::fields::Line;
use super::{StampedPose, write_lines};
use crate::read_text;
use crate::{Error, Result};

const NAMES: [&str; 12] = ["r11", "r12", "r13", "tx", "r21", "r22", "r23", "ty", "r31", "r32", "r33", "tz"];

/// Reads a KITTI trajectory: twelve numbers a line, the upper three rows of the camera-to-world matrix.
///
/// The format has no times: they come from `times`, a file of one time in seconds a line, or are 0, 1, 2 and so on.
pub fn read_kitti(path: impl AsRef<Path>, times: Option<&Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    let text = read_text(path)?;
    let poses: Vec<_> = Line::all(path, &text).map(pose).collect::<Result<_>>()?;
    let times = match times {
        Some(times) => read_times(times, path, poses.len())?,
        None => (0..poses.len()).map(|index| index as f64).collect(),
    };
    let poses = poses.into_iter().zip(times);
    Ok(poses.map(|(world_from_camera, timestamp_s)| StampedPose { timestamp_s, world_from_camera }).collect())
}

fn pose(line: Line<'_>) -> Result<nalgebra::Isometry3<f64>> {
    let [a, b, c, d, e, f, g, h, i, j, k, l] = line.numbers(NAMES)?;
    line.matrix_pose([[a, b, c, d], [e, f, g, h], [i, j, k, l]])
}

fn read_times(path: &Path, poses: &Path, count: usize) -> Result<Vec<f64>> {
    let text = read_text(path)?;
    let times = Line::all(path, &text).map(|line| line.numbers(["time"]).map(|[time]| time));
    let times: Vec<f64> = times.collect::<Result<_>>()?;
    if times.len() != count {
        let reason = format!("has {} times, expected {count} as poses in {}", times.len(), poses.display());
        return Err(Error::format(path, reason));
    }
    Ok(times)
}

/// Writes a KITTI trajectory: the upper three rows of the camera-to-world matrix, row by row, one pose a line.
pub fn write_kitti(path: impl AsRef<Path>, poses: &[StampedPose]) -> Result<()> {
    write_lines(path.as_ref(), "", poses, |pose, line| {
        let matrix = with_computer_vision_axes(&pose.world_from_camera).to_homogeneous();
        let rows = (0..3).flat_map(|row| (0..4).map(move |column| (row, column)));
        let fields: Vec<_> = rows.map(|place| matrix[place].to_string()).collect();
        line.write_str(&fields.join(" "))
    })
}
