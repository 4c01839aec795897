//! The inertial unit that a survey names, and the turns that it measured between stations.

use std::path::Path;

use commands::{read_inertial, root_of};
use inertial::{Biases, ImuNoise, InertialSample, Preintegrated, rest};
use multiview_registration::MeasuredTurn;
use nalgebra::{Isometry3, Matrix3, Vector3};
use pipeline::stations::Station;
use pipeline::{Error, Result};
use range_io::survey::Survey;
use range_io::tables::ImuSample;

/// Samples of the unit that the survey names, and the pose of its axes in the camera's; `None` where it names none.
pub(crate) fn read(survey: &Survey, root: &Path) -> Result<Option<(Vec<InertialSample>, Isometry3<f64>)>> {
    let Some((samples, camera_from_body)) = read_inertial(survey, root)? else { return Ok(None) };
    let sample = |sample: ImuSample| InertialSample {
        timestamp_s: sample.timestamp_s,
        angular_rate: Vector3::from(sample.angular_rate),
        specific_force: Vector3::from(sample.acceleration),
    };
    Ok(Some((samples.into_iter().map(sample).collect(), camera_from_body)))
}

/// How the camera turned from each station to the next; none where the survey names no inertial data.
///
/// Where the unit rested before the first station, its rates there are their bias; else that is not known, and the turns are hardly so.
///
/// # Errors
/// [`Error::Request`] for data with gaps between stations, and stations that do not follow each other in time.
pub(crate) fn turns(path: &Path, survey: &Survey, stations: &[Station]) -> Result<Vec<MeasuredTurn>> {
    let Some((samples, camera_from_body)) = read(survey, &root_of(path))? else { return Ok(Vec::new()) };
    let noise = ImuNoise::default();
    let first_s = stations.first().map_or(f64::NAN, |station| station.timestamp_s);
    let before = samples.partition_point(|sample| sample.timestamp_s <= first_s);
    let (bias, variance) = match rest(samples.get(..before).unwrap_or_default(), &noise) {
        Ok(rest) => (rest.rate, noise.gyro_density.powi(2) / rest.seconds),
        Err(_) => (Vector3::zeros(), noise.gyro_bias_sigma.powi(2)),
    };
    let biases = Biases { gyro: bias, accel: Vector3::zeros() };
    let turned = camera_from_body.rotation;
    let turn = |(index, pair): (usize, &[Station])| {
        let interval_s = [pair[0].timestamp_s, pair[1].timestamp_s];
        let motion = Preintegrated::new(&samples, interval_s, &biases, &noise).map_err(|error| {
            let message = format!(
                "inertial data between stations {} and {} (without `imu` among its extras the survey is registered by its frames \
                 alone): {error}",
                pair[0].name, pair[1].name
            );
            Error::Request { command: "register", message }
        })?;
        let by_bias = motion.by_biases.fixed_view::<3, 3>(0, 0);
        let walk = noise.gyro_walk.powi(2) * (interval_s[1] - first_s) / 3.0;
        let of_bias = by_bias * by_bias.transpose() * (variance + walk);
        let covariance: Matrix3<f64> = motion.covariance.fixed_view::<3, 3>(0, 0) + of_bias;
        let to_camera = turned.to_rotation_matrix().into_inner();
        Ok(MeasuredTurn {
            first: index,
            second: index + 1,
            first_from_second: turned * motion.rotation * turned.inverse(),
            covariance: to_camera * covariance * to_camera.transpose(),
        })
    };
    stations.windows(2).enumerate().map(turn).collect()
}
