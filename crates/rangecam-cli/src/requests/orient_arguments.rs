//! What can be typed behind `rangecam orient`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use orientation_tasks::{OrientBy, OrientRequest, TrackerOptions};

use crate::requests::calibration::calibrate_arguments::default_out;
use crate::requests::values::{lengths, positive};

/// Arguments of an orientation.
#[derive(Debug, Args)]
pub(crate) struct OrientArguments {
    /// Folder with survey.ron; frames are not read but for their times.
    survey: PathBuf,
    /// By what.
    #[arg(long, value_enum)]
    by: By,
    /// Poses of the tracker: TUM (timestamp tx ty tz qx qy qz qw) or EuRoC.
    #[arg(long, value_name = "FILE", required_if_eq("by", "tracker"))]
    poses: Option<PathBuf>,
    /// Stations whose poses are known, for imu and tracker: stations.csv or a trajectory; default: stations.csv of the survey.
    #[arg(long, value_name = "FILE")]
    known: Option<PathBuf>,
    /// Largest difference of the tracker's clock from the camera's, which is then found; default: none.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    time_offset_within: Option<f64>,
    /// The camera in the axes of what is tracked, good to 5 mm; default: it is found.
    #[arg(long, value_name = "X,Y,Z", value_parser = lengths, allow_hyphen_values = true)]
    lever_arm: Option<[f64; 3]>,
    /// Longest time between two poses of the tracker that are interpolated.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = positive)]
    longest_gap: f64,
    /// Standard deviation of the tracker's positions.
    #[arg(long, value_name = "METRE", default_value_t = 0.005, value_parser = positive)]
    sigma_position: f64,
    /// Standard deviation of the tracker's attitudes.
    #[arg(long, value_name = "DEGREE", default_value_t = 0.2, value_parser = positive)]
    sigma_attitude: f64,
    /// Standard deviation of image points that have none in observations.csv; default: they are refused.
    #[arg(long, value_name = "PIXEL", value_parser = positive)]
    sigma_pixel: Option<f64>,
    /// The same of ranges.
    #[arg(long, value_name = "METRE", value_parser = positive)]
    sigma_range: Option<f64>,
    /// calibration.ron; default: the one beside survey.ron, if there is one.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Output folder; default: out/<name of the survey>-oriented.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

/// By what stations are oriented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    /// observations.csv, with targets.csv as control, or without as tie points.
    Targets,
    /// imu.csv (or what survey.ron names as `imu`), from known poses on.
    Imu,
    /// Poses of a tracker, a robot or satellites.
    Tracker,
}

impl OrientArguments {
    pub(crate) fn request(self) -> OrientRequest {
        let out = self.out.unwrap_or_else(|| default_out(&self.survey, "-oriented"));
        let by = match self.by {
            By::Targets => OrientBy::Targets { sigma_pixel: self.sigma_pixel, sigma_range_m: self.sigma_range },
            By::Imu => OrientBy::Imu { known: self.known },
            By::Tracker => OrientBy::Tracker(TrackerOptions {
                known: self.known,
                time_offset_within_s: self.time_offset_within,
                lever_arm_m: self.lever_arm,
                sigma_position_m: self.sigma_position,
                sigma_attitude_rad: self.sigma_attitude.to_radians(),
                longest_gap_s: self.longest_gap,
                ..TrackerOptions::new(self.poses.unwrap_or_default())
            }),
        };
        OrientRequest { survey: self.survey, by, calibration: self.calibration, out }
    }
}
