//! `sensor.yaml` of an `EuRoC` inertial folder: noise and mounting. Of YAML only what these files use is read: `key: value` lines, a
//! matrix as `data: [...]`, comments.

use std::path::Path;

use crate::read_text;
use crate::{Error, Result};

/// Noise and mounting of an inertial unit, as `sensor.yaml` states them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuSensor {
    /// Pose of the unit in the body's frame (`T_BS`), rows of a 4 x 4 matrix, metre.
    pub body_from_sensor: [[f64; 4]; 4],
    /// Noise density of the rates, rad/s/√Hz.
    pub gyro_density: f64,
    /// Random walk of the rates' bias, rad/s²/√Hz.
    pub gyro_walk: f64,
    /// Noise density of the specific forces, m/s²/√Hz.
    pub accel_density: f64,
    /// Random walk of the forces' bias, m/s³/√Hz.
    pub accel_walk: f64,
}

/// Reads `sensor.yaml`, or that of a folder (`mav0/imu0` or its parents).
///
/// # Errors
/// The file cannot be read; a value is missing, no number, or not positive; the mounting is no rigid pose.
pub fn read_imu_sensor(path: impl AsRef<Path>) -> Result<ImuSensor> {
    let path = path.as_ref();
    let inside = ["sensor.yaml", "imu0/sensor.yaml", "mav0/imu0/sensor.yaml"].map(|name| path.join(name));
    let file = inside.iter().find(|file| file.is_file()).map_or(path, |file| file.as_path());
    let text = read_text(file)?;
    let sensor = Yaml { file, text: &text };
    Ok(ImuSensor {
        body_from_sensor: sensor.matrix()?,
        gyro_density: sensor.positive("gyroscope_noise_density")?,
        gyro_walk: sensor.positive("gyroscope_random_walk")?,
        accel_density: sensor.positive("accelerometer_noise_density")?,
        accel_walk: sensor.positive("accelerometer_random_walk")?,
    })
}

struct Yaml<'t> {
    file: &'t Path,
    text: &'t str,
}

impl<'t> Yaml<'t> {
    fn fault(&self, line: usize, field: &str, reason: impl Into<String>) -> Error {
        let file = self.file.to_owned();
        Error::Text { file, line: line + 1, column: 1, field: field.to_owned(), reason: reason.into() }
    }

    /// Number of the line of a key, and what stands behind it up to a comment.
    fn value(&self, key: &str) -> Result<(usize, &'t str)> {
        let mut lines = self.text.lines().enumerate();
        let found = lines.find_map(|(line, text)| {
            let (name, value) = text.split_once(':')?;
            (name.trim() == key).then(|| (line, value.split('#').next().unwrap_or_default().trim()))
        });
        found.ok_or_else(|| self.fault(0, key, "is missing"))
    }

    fn positive(&self, key: &str) -> Result<f64> {
        let (line, value) = self.value(key)?;
        let number = value.parse::<f64>().ok().filter(|number| *number > 0.0 && number.is_finite());
        number.ok_or_else(|| self.fault(line, key, format!("is `{value}`, expected a positive number")))
    }

    /// The sixteen numbers of `data: [...]` below `T_BS`, which may stand on several lines.
    fn matrix(&self) -> Result<[[f64; 4]; 4]> {
        let (line, _) = self.value("T_BS")?;
        let refuse = |reason| self.fault(line, "T_BS", reason);
        let below: String = self.text.lines().skip(line).collect::<Vec<_>>().join(" ");
        let list = below.split_once("data:").and_then(|(_, rest)| rest.split_once('[')?.1.split_once(']'));
        let (list, _) = list.ok_or_else(|| refuse("expected `data: [...]` below"))?;
        let numbers: Vec<f64> = list.split(',').filter_map(|number| number.trim().parse().ok()).collect();
        if numbers.len() != 16 || numbers.iter().any(|number| !number.is_finite()) {
            return Err(refuse("expected the sixteen numbers of a 4 x 4 matrix"));
        }
        let matrix: [[f64; 4]; 4] = std::array::from_fn(|row| std::array::from_fn(|column| numbers[4 * row + column]));
        let product = |i: usize, j: usize| (0..3).map(|k| matrix[i][k] * matrix[j][k]).sum::<f64>();
        let orthonormal = (0..9).all(|k| (product(k / 3, k % 3) - f64::from(u8::from(k / 3 == k % 3))).abs() < 1e-3);
        let minor = |j: usize, k: usize| matrix[1][j] * matrix[2][k] - matrix[1][k] * matrix[2][j];
        let determinant = matrix[0][0] * minor(1, 2) - matrix[0][1] * minor(0, 2) + matrix[0][2] * minor(0, 1);
        let last = matrix[3].iter().zip([0.0, 0.0, 0.0, 1.0]).all(|(found, right)| (found - right).abs() < 1e-9);
        if orthonormal && determinant > 0.0 && last {
            return Ok(matrix);
        }
        Err(refuse("expected a rotation that is not mirrored, a translation, and 0, 0, 0, 1 in the last row"))
    }
}
