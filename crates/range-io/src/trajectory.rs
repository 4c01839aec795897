//! Trajectories: TUM, KITTI and `EuRoC` text files.
//!
//! Poses in memory have photogrammetric camera axes, poses in these files computer-vision axes; the turn happens here and
//! only here, by [`camera_model::with_computer_vision_axes`]. The world stays as it is.

use std::fmt::Write;
use std::path::Path;

use camera_model::with_computer_vision_axes;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use crate::text::read_text;
use crate::{Error, Result, atomic};

/// A pose at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedPose {
    /// Time in seconds.
    pub timestamp_s: f64,
    /// Pose, photogrammetric camera axes.
    pub world_from_camera: Isometry3<f64>,
}

/// Largest deviation of a quaternion's length from 1: files with three decimals are common.
const LENGTH_TOLERANCE: f64 = 5e-3;
const TUM_FIELDS: [&str; 8] = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"];

/// Reads a TUM trajectory: `timestamp tx ty tz qx qy qz qw`, lines that begin with `#` are comments.
pub fn read_tum(path: impl AsRef<Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    let text = read_text(path)?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    lines.map(|(index, line)| tum_pose(path, index + 1, line)).collect()
}

fn tum_pose(file: &Path, line: usize, text: &str) -> Result<StampedPose> {
    let error = |column: usize, field: &str, reason: String| {
        let file = file.to_path_buf();
        Error::Text { file, line, column, field: field.to_owned(), reason }
    };
    let mut values = [0.0; 8];
    let mut fields = text.split_whitespace();
    for (index, (value, name)) in values.iter_mut().zip(TUM_FIELDS).enumerate() {
        let field = fields.next().ok_or_else(|| error(index + 1, name, "is missing".into()))?;
        let number = field.parse().ok().filter(|number: &f64| number.is_finite());
        *value = number.ok_or_else(|| error(index + 1, name, format!("is `{field}`, expected a finite number")))?;
    }
    if let Some(surplus) = fields.next() {
        return Err(error(9, "", format!("`{surplus}` is one field too many, expected 8")));
    }
    let [timestamp_s, tx, ty, tz, qx, qy, qz, qw] = values;
    let quaternion = Quaternion::new(qw, qx, qy, qz);
    let length = quaternion.norm();
    if (length - 1.0).abs() > LENGTH_TOLERANCE {
        return Err(error(5, "qx qy qz qw", format!("has length {length}, expected 1")));
    }
    let rotation = UnitQuaternion::from_quaternion(quaternion);
    let pose = Isometry3::from_parts(Translation3::new(tx, ty, tz), rotation);
    Ok(StampedPose { timestamp_s, world_from_camera: with_computer_vision_axes(&pose) })
}

/// Writes a TUM trajectory, one blank between fields, every number with the digits that give it back.
pub fn write_tum(path: impl AsRef<Path>, poses: &[StampedPose]) -> Result<()> {
    write_lines(path.as_ref(), "", poses, |pose, line| {
        let Isometry3 { rotation: q, translation: t } = with_computer_vision_axes(&pose.world_from_camera);
        write!(line, "{} {} {} {} {} {} {} {}", pose.timestamp_s, t.x, t.y, t.z, q.i, q.j, q.k, q.w)
    })
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

/// Writes an `EuRoC` pose file: nanoseconds, position, quaternion `w x y z`.
pub fn write_euroc(path: impl AsRef<Path>, poses: &[StampedPose]) -> Result<()> {
    const HEADER: &str = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],\
                          q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n";
    write_lines(path.as_ref(), HEADER, poses, |pose, line| {
        let Isometry3 { rotation: q, translation: t } = with_computer_vision_axes(&pose.world_from_camera);
        // An i64 of nanoseconds reaches 292 years; the cast saturates beyond.
        let time_ns = (pose.timestamp_s * 1e9).round() as i64;
        write!(line, "{time_ns},{},{},{},{},{},{},{}", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
    })
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
    atomic::write_text(path, &text)
}
