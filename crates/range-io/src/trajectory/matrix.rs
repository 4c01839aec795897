use std::path::Path;

use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, UnitQuaternion};

use crate::{Error, Result, read_text};

/// How far the rows of a rotation may be from unit length and right angles.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Reads a rigid motion from a file of sixteen numbers, row by row, as they stand: no axes are turned. `None` where the file
/// holds something else.
///
/// # Errors
/// [`Error::Format`] where the sixteen numbers are no rigid motion.
pub fn read_matrix(path: impl AsRef<Path>) -> Result<Option<Isometry3<f64>>> {
    let path = path.as_ref();
    // Some trajectories are folders.
    if path.is_dir() {
        return Ok(None);
    }
    let text = read_text(path)?;
    let words: Vec<&str> = text.split([' ', '\t', '\n', '\r', ',', ';']).filter(|word| !word.is_empty()).collect();
    let numbers: Vec<f64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    if words.len() != 16 || numbers.len() != 16 {
        return Ok(None);
    }
    let matrix = Matrix4::from_row_slice(&numbers);
    let turn: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let last_row = [matrix[(3, 0)], matrix[(3, 1)], matrix[(3, 2)], matrix[(3, 3)]];
    let is_rotation = (turn * turn.transpose() - Matrix3::identity()).norm() < ROTATION_TOLERANCE
        && turn.determinant() > 0.0
        && last_row.map(f64::to_bits) == [0.0, 0.0, 0.0, 1.0].map(f64::to_bits)
        && matrix.iter().all(|value| value.is_finite());
    if !is_rotation {
        return Err(Error::format(path, "is no rigid motion: expected a rotation, a translation and 0 0 0 1"));
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&turn));
    let translation = matrix.fixed_view::<3, 1>(0, 3).into_owned().into();
    Ok(Some(Isometry3::from_parts(translation, rotation)))
}
