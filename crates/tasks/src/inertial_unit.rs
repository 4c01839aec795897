//! Turns between stations that an inertial unit measured.

use std::path::Path;

use commands::{InertialUnit, read_inertial, root_of};
use inertial::{Biases, Preintegrated, rest};
use multiview_registration::MeasuredTurn;
use nalgebra::{Matrix3, Vector3};
use pipeline::stations::Station;
use pipeline::{Error, Result};
use range_io::survey::Survey;

/// How the camera turned from each station to the next; none where the survey names no inertial data.
///
/// Where the unit rested before the first station, its rates there are their bias; else that is not known, and the turns are hardly so.
///
/// # Errors
/// [`Error::Request`] for data with gaps between stations, and stations that do not follow each other in time.
pub(crate) fn turns(path: &Path, survey: &Survey, stations: &[Station]) -> Result<Vec<MeasuredTurn>> {
    let Some(InertialUnit { samples, camera_from_body, noise }) = read_inertial(survey, &root_of(path))? else {
        return Ok(Vec::new());
    };
    let first_s = stations.first().map_or(f64::NAN, |station| station.timestamp_s);
    let before = samples.partition_point(|sample| sample.timestamp_s <= first_s);
    let (bias, variance) = match rest(samples.get(..before).unwrap_or_default(), &noise) {
        Ok(rest) => (rest.rate, rest.rate_variance(&noise)),
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
