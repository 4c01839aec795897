//! The inertial unit that a survey names.

use std::path::Path;

use inertial::{ImuNoise, InertialSample};
use nalgebra::{Isometry3, Vector3};
use range_io::survey::Survey;
use range_io::tables::{ImuSample, read_imu, read_imu_sensor};
use range_io::trajectory::read_matrix;

use crate::{Error, Result};

/// Name among a survey's extras of inertial data: `imu.csv`, or an `EuRoC` folder.
pub const INERTIAL_DATA: &str = "imu";
/// Name among them of sixteen numbers, row by row: the pose of the unit's axes in the camera's (photogrammetric).
pub const INERTIAL_MOUNTING: &str = "camera_from_imu";

/// What an inertial unit measured, and what is known of it.
#[derive(Debug, Clone)]
pub struct InertialUnit {
    /// Samples, ascending in time.
    pub samples: Vec<InertialSample>,
    /// Pose of its axes in the camera's.
    pub camera_from_body: Isometry3<f64>,
    /// Its noise: that of the `sensor.yaml` of an `EuRoC` folder, else [`ImuNoise::default`].
    pub noise: ImuNoise,
}

impl InertialUnit {
    /// Reads `imu.csv` or an `EuRoC` folder with the `sensor.yaml` that stands in it; its axes are those of the camera.
    ///
    /// # Errors
    /// Those of [`read_imu`] and [`read_imu_sensor`].
    pub fn read(path: &Path) -> Result<Self> {
        let sample = |sample: ImuSample| InertialSample {
            timestamp_s: sample.timestamp_s,
            angular_rate: Vector3::from(sample.angular_rate),
            specific_force: Vector3::from(sample.acceleration),
        };
        let samples = read_imu(path)?.into_iter().map(sample).collect();
        let stated =
            ["sensor.yaml", "imu0/sensor.yaml", "mav0/imu0/sensor.yaml"].iter().any(|name| path.join(name).is_file());
        let mut noise = ImuNoise::default();
        if stated {
            let sensor = read_imu_sensor(path)?;
            (noise.gyro_density, noise.gyro_walk) = (sensor.gyro_density, sensor.gyro_walk);
            (noise.accel_density, noise.accel_walk) = (sensor.accel_density, sensor.accel_walk);
        }
        Ok(Self { samples, camera_from_body: Isometry3::identity(), noise })
    }
}

/// Reads the inertial unit that a survey names, with the pose of its axes in the camera's, the identity where none is named; `None`
/// without data.
///
/// # Errors
/// Those of [`InertialUnit::read`] and [`read_matrix`]; [`Error::Survey`] for a mounting that is no matrix.
pub fn read_inertial(survey: &Survey, root: &Path) -> Result<Option<InertialUnit>> {
    let Some(file) = survey.extras.get(INERTIAL_DATA) else { return Ok(None) };
    let mut unit = InertialUnit::read(&root.join(file))?;
    if let Some(file) = survey.extras.get(INERTIAL_MOUNTING) {
        let path = root.join(file);
        let message = "expected the sixteen numbers of a 4 x 4 matrix".to_owned();
        unit.camera_from_body = read_matrix(&path)?.ok_or(Error::Survey { path, message })?;
    }
    Ok(Some(unit))
}
