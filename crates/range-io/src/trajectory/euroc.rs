use std::fmt::Write;
use std::path::Path;

use camera_model::with_computer_vision_axes;
use nalgebra::Isometry3;

use super::fields::Line;
use super::{StampedPose, write_lines};
use crate::Result;
use crate::read_text;

const NAMES: [&str; 8] = ["timestamp", "p_x", "p_y", "p_z", "q_w", "q_x", "q_y", "q_z"];

const NANOSECONDS: i64 = 1_000_000_000;

/// Reads an `EuRoC` pose file: nanoseconds, position, quaternion `w x y z`; further columns (velocity, biases of a ground
/// truth) are left alone.
///
/// A time in seconds of this century is right to 0.2 microseconds.
pub fn read_euroc(path: impl AsRef<Path>) -> Result<Vec<StampedPose>> {
    let path = path.as_ref();
    let text = read_text(path)?;
    Line::all(path, &text).map(pose).collect()
}

fn pose(line: Line<'_>) -> Result<StampedPose> {
    let mut words = line.text.split(',').map(str::trim);
    let mut values = [0.0; 8];
    let time = words.next().unwrap_or_default();
    let time_ns: i64 = time
        .parse()
        .map_err(|_| line.error(1, NAMES[0], format!("is `{time}`, expected nanoseconds as a whole number")))?;
    for (index, (value, name)) in values.iter_mut().zip(NAMES).enumerate().skip(1) {
        *value = line.number(index + 1, name, words.next())?;
    }
    let [_, tx, ty, tz, qw, qx, qy, qz] = values;
    let (seconds, rest_ns) = (time_ns.div_euclid(NANOSECONDS), time_ns.rem_euclid(NANOSECONDS));
    let timestamp_s = seconds as f64 + rest_ns as f64 / 1e9;
    let world_from_camera = line.pose([tx, ty, tz], [qx, qy, qz, qw], 5, "q_w q_x q_y q_z")?;
    Ok(StampedPose { timestamp_s, world_from_camera })
}

/// Writes an `EuRoC` pose file: nanoseconds, position, quaternion `w x y z`.
pub fn write_euroc(path: impl AsRef<Path>, poses: &[StampedPose]) -> Result<()> {
    const HEADER: &str = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],\
                          q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n";
    write_lines(path.as_ref(), HEADER, poses, |pose, line| {
        let Isometry3 { rotation: q, translation: t } = with_computer_vision_axes(&pose.world_from_camera);
        // Whole seconds apart: their product with 1e9 has more digits than an f64. An i64 of nanoseconds reaches 292
        // years; casts and sums saturate beyond.
        let seconds = pose.timestamp_s.floor();
        let rest_ns = ((pose.timestamp_s - seconds) * 1e9).round() as i64;
        let time_ns = (seconds as i64).saturating_mul(NANOSECONDS).saturating_add(rest_ns);
        write!(line, "{time_ns},{},{},{},{},{},{},{}", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
    })
}
