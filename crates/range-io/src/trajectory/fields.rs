//! Numbers of a line, and poses made of them.

use std::path::Path;

use camera_model::with_computer_vision_axes;
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};

use crate::pose::pose_of;
use crate::{Error, Result};

/// Largest deviation of R Rᵀ from the identity: matrices with three decimals are common.
const ORTHOGONALITY_TOLERANCE: f64 = 5e-3;

/// A line of a file, for numbers and for messages.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub file: &'a Path,
    /// From 1.
    pub number: usize,
    pub text: &'a str,
}

impl<'a> Line<'a> {
    /// Lines that are neither empty nor comments.
    pub fn all(file: &'a Path, text: &'a str) -> impl Iterator<Item = Line<'a>> {
        let lines = text.lines().enumerate().map(move |(index, text)| Line { file, number: index + 1, text });
        lines.filter(|line| !line.text.trim().is_empty() && !line.text.trim_start().starts_with('#'))
    }

    pub fn error(&self, column: usize, field: &str, reason: impl Into<String>) -> Error {
        let file = self.file.to_path_buf();
        Error::Text { file, line: self.number, column, field: field.to_owned(), reason: reason.into() }
    }

    pub fn words(&self) -> impl Iterator<Item = &'a str> {
        self.text.split_whitespace()
    }

    /// A finite number in `column` (from 1).
    pub fn number(&self, column: usize, name: &str, word: Option<&str>) -> Result<f64> {
        let word = word.filter(|word| !word.is_empty()).ok_or_else(|| self.error(column, name, "is missing"))?;
        let number = word.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| self.error(column, name, format!("is `{word}`, expected a finite number")))
    }

    /// Exactly `N` finite numbers between blanks.
    pub fn numbers<const N: usize>(&self, names: [&str; N]) -> Result<[f64; N]> {
        let mut words = self.words();
        let mut values = [0.0; N];
        for (index, (value, name)) in values.iter_mut().zip(names).enumerate() {
            *value = self.number(index + 1, name, words.next())?;
        }
        match words.next() {
            Some(surplus) => Err(self.error(N + 1, "", format!("`{surplus}` is one field too many, expected {N}"))),
            None => Ok(values),
        }
    }

    /// Pose of a translation and a quaternion `x y z w` in computer-vision axes; `column` is that of the quaternion.
    pub fn pose(
        &self,
        translation: [f64; 3],
        quaternion: [f64; 4],
        column: usize,
        names: &str,
    ) -> Result<Isometry3<f64>> {
        let pose = pose_of(&translation, &quaternion).ok_or_else(|| {
            let [x, y, z, w] = quaternion;
            self.error(column, names, format!("has length {}, expected 1", Quaternion::new(w, x, y, z).norm()))
        })?;
        Ok(with_computer_vision_axes(&pose))
    }

    /// Pose of the upper three rows of a matrix in computer-vision axes.
    pub fn matrix_pose(&self, rows: [[f64; 4]; 3]) -> Result<Isometry3<f64>> {
        let [[a, b, c, tx], [d, e, f, ty], [g, h, i, tz]] = rows;
        let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
        let fault = (matrix * matrix.transpose() - Matrix3::identity()).amax();
        if !(fault <= ORTHOGONALITY_TOLERANCE && matrix.determinant() > 0.0) {
            let reason = format!("is no rotation: R R^T differs from the identity by {fault:.1e}");
            let reason =
                if matrix.determinant() > 0.0 { reason } else { "is a reflection, expected a rotation".into() };
            return Err(self.error(1, "R", reason));
        }
        let rotation = nearest_rotation(&matrix).ok_or_else(|| self.error(1, "R", "is no rotation"))?;
        Ok(with_computer_vision_axes(&Isometry3::from_parts(Translation3::new(tx, ty, tz), rotation)))
    }
}

/// The rotation U Vᵀ of a matrix U S Vᵀ that is one but for rounding.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Option<UnitQuaternion<f64>> {
    let svd = matrix.try_svd(true, true, 1e-15, 1000)?;
    let rotation = Rotation3::from_matrix_unchecked(svd.u? * svd.v_t?);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// Four lines of four numbers from `lines`: a 4x4 matrix whose last row is `0 0 0 1`.
pub(super) fn matrix_of_lines<'a>(
    lines: &mut impl Iterator<Item = Line<'a>>,
    above: Line<'a>,
) -> Result<Isometry3<f64>> {
    let mut rows = [[0.0; 4]; 4];
    let mut last = above;
    let mut first = None;
    for (index, row) in rows.iter_mut().enumerate() {
        let line =
            lines.next().ok_or_else(|| last.error(1, "", format!("is the last line, {index} of 4 rows are there")))?;
        *row = line.numbers(["column 1", "column 2", "column 3", "column 4"])?;
        first.get_or_insert(line);
        last = line;
    }
    let [a, b, c, end] = rows;
    let difference = end.iter().zip([0.0, 0.0, 0.0, 1.0]).map(|(found, expected)| (found - expected).abs());
    if difference.fold(0.0, f64::max) > 1e-9 {
        return Err(last.error(1, "", "is the fourth row of a pose, expected 0 0 0 1"));
    }
    first.unwrap_or(above).matrix_pose([a, b, c])
}
