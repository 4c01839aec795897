//! Poses that are known before: rows of a table of stations, or a trajectory at the frames' times.

use std::path::Path;

use nalgebra::{Matrix6, Vector6};
use orientation::TimedPose;
use pipeline::{Error, Result};
use range_io::tables::read_stations;
use range_io::trajectory::read_any_trajectory;
use rigid_pose::Uncertain;

use crate::camera::SurveyCamera;

/// Standard deviations of poses that state none: metre and radian (5 mm, 0.2 degrees), what registrations and resections of range
/// cameras mostly reach.
const SIGMAS: [f64; 2] = [0.005, 0.0035];
/// Times of a trajectory and of frames belong together within this, second.
const SAME_TIME_S: f64 = 5e-3;

/// Stations whose poses are known, ascending in time.
pub(crate) struct Known {
    pub(crate) names: Vec<String>,
    pub(crate) poses: Vec<TimedPose>,
    /// How many state no standard deviation.
    pub(crate) without_sigma: usize,
}

impl Known {
    /// Reads those of the survey's stations that `file` (or `stations.csv` of the survey) has.
    ///
    /// # Errors
    /// [`Error::Request`] where it has none of them, or two stations have the same time.
    pub(crate) fn read(camera: &SurveyCamera, file: Option<&Path>) -> Result<Self> {
        let file = file.map_or_else(|| camera.root.join("stations.csv"), Path::to_owned);
        let wrong =
            |message: String| Error::Request { command: "orient", message: format!("{}: {message}", file.display()) };
        let stations = camera.timed_stations()?;
        let is_table = range_io::read_text(&file).is_ok_and(|text| text.trim_start().starts_with("station"));
        let mut found: Vec<(String, f64, Uncertain, bool)> = Vec::new();
        if is_table || file.extension().is_some_and(|ending| ending == "csv") && !file.is_file() {
            let rows = read_stations(&file)?;
            for (name, time_s) in &stations {
                let Some(row) = rows.iter().find(|row| row.station == *name) else { continue };
                let stated = row.covariance();
                let covariance = stated.unwrap_or_else(default_covariance);
                let pose = Uncertain { pose: row.world_from_camera, covariance };
                found.push((name.clone(), *time_s, pose, stated.is_some()));
            }
        } else {
            let trajectory = read_any_trajectory(&file)?;
            for (name, time_s) in &stations {
                let near = trajectory.iter().find(|pose| (pose.timestamp_s - time_s).abs() < SAME_TIME_S);
                let Some(near) = near else { continue };
                let pose = Uncertain { pose: near.world_from_camera, covariance: default_covariance() };
                found.push((name.clone(), *time_s, pose, false));
            }
        }
        if found.is_empty() {
            return Err(wrong("has the pose of no station that survey.ron lists frames of".to_owned()));
        }
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((a, b)) =
            found.windows(2).find(|pair| pair[0].1 >= pair[1].1).and_then(|pair| pair.first().zip(pair.last()))
        {
            return Err(wrong(format!("stations {} and {} have the same time, {} s", a.0, b.0, a.1)));
        }
        Ok(Self {
            without_sigma: found.iter().filter(|one| !one.3).count(),
            poses: found.iter().map(|(_, time_s, pose, _)| TimedPose { time_s: *time_s, pose: *pose }).collect(),
            names: found.into_iter().map(|one| one.0).collect(),
        })
    }

    /// What is assumed of poses without standard deviations.
    pub(crate) fn assumed(&self) -> Option<String> {
        (self.without_sigma > 0).then(|| {
            format!(
                "{} known poses state no standard deviation and were taken as good to {:.0} mm and {:.1} degrees",
                self.without_sigma,
                1e3 * SIGMAS[0],
                SIGMAS[1].to_degrees()
            )
        })
    }
}

fn default_covariance() -> Matrix6<f64> {
    covariance(SIGMAS[0], SIGMAS[1])
}

/// The same along and about all axes.
pub(crate) fn covariance(position_m: f64, attitude_rad: f64) -> Matrix6<f64> {
    let (p, a) = (position_m * position_m, attitude_rad * attitude_rad);
    Matrix6::from_diagonal(&Vector6::new(p, p, p, a, a, a))
}
