//! `mountings.csv`, as a calibration of a rig writes it.

use std::path::Path;

use camera_model::pose_from_euler;
use nalgebra::{Isometry3, Vector3};
use pipeline::{Error, Result};
use range_io::read_text;

/// Columns behind the camera's name: place, angles, and the standard deviations of both.
const NUMBERS: usize = 12;

/// Reads the mountings of the cameras of a rig by their names: `rig_from_camera`.
///
/// # Errors
/// A file that cannot be read, or a line that is no mounting, by its number.
pub fn read_mountings(path: impl AsRef<Path>) -> Result<Vec<(String, Isometry3<f64>)>> {
    let path = path.as_ref();
    let text = read_text(path)?;
    let lines = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
    lines.map(|(index, line)| mounting(line).ok_or_else(|| no_mounting(path, index))).collect()
}

fn mounting(line: &str) -> Option<(String, Isometry3<f64>)> {
    // The name is the first field, and may hold commas between quotation marks.
    let fields: Vec<&str> = line.rsplitn(NUMBERS + 1, ',').collect();
    let name = fields.get(NUMBERS)?;
    let name = name
        .strip_prefix('"')
        .and_then(|name| name.strip_suffix('"'))
        .map_or_else(|| (*name).to_owned(), |quoted| quoted.replace("\"\"", "\""));
    let number =
        |column: usize| fields[NUMBERS - 1 - column].trim().parse().ok().filter(|value: &f64| value.is_finite());
    let place = Vector3::new(number(0)?, number(1)?, number(2)?);
    let angles = [number(3)?, number(4)?, number(5)?].map(f64::to_radians);
    Some((name, pose_from_euler(place, angles)))
}

fn no_mounting(path: &Path, index: usize) -> Error {
    let message = format!(
        "line {}: expected a camera, x, y, z (metre), omega, phi, kappa (degree) and their six standard deviations, as `rangecam \
         calibrate` of a rig writes them",
        index + 1
    );
    Error::Survey { path: path.to_owned(), message }
}
