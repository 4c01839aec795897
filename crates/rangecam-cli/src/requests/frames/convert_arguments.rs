//! What can be typed behind `convert`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use recording_tasks::ConvertRequest;
use recording_tasks::range_io::survey::Level;

use crate::requests::values::name;

#[derive(Debug, Args)]
pub(crate) struct ConvertArguments {
    /// A recording (MCAP, ROS 1 bag, Azure Kinect .mkv, ADI .bin or .adcam), or a survey's folder.
    input: PathBuf,
    /// A folder for a survey, or a file that ends in .mcap; default: out/<name of the input>.
    #[arg(long, short)]
    out: Option<PathBuf>,
    /// The stream whose images become frames, by the name that `inspect` shows; default: the only one of depths or ranges.
    #[arg(long, value_name = "NAME")]
    stream: Option<String>,
    /// What its values are; default: what the recording says.
    #[arg(long, value_enum)]
    level: Option<LevelName>,
    /// The stream of inertial samples; default: the only one.
    #[arg(long, value_name = "NAME")]
    imu: Option<String>,
    /// calibration.ron whose camera is taken in place of the recording's, or of the survey's.
    #[arg(long, short)]
    calibration: Option<PathBuf>,
    /// One station for all frames, of a camera at rest; default: each frame is a station of its own.
    #[arg(long, value_name = "NAME", value_parser = name)]
    station: Option<String>,
}

/// Levels that images of a recording can be at.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum LevelName {
    /// Along the viewing axis.
    Depth,
    /// Along the rays.
    Range,
    /// Light alone.
    Intensity,
}

impl ConvertArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> ConvertRequest {
        let default = || PathBuf::from("out").join(self.input.file_stem().unwrap_or_default());
        let level = self.level.map(|level| match level {
            LevelName::Depth => Level::Depth,
            LevelName::Range => Level::Range,
            LevelName::Intensity => Level::Intensity,
        });
        ConvertRequest {
            out: self.out.clone().unwrap_or_else(default),
            stream: self.stream,
            level,
            imu: self.imu,
            calibration: self.calibration,
            station: self.station,
            ..ConvertRequest::new(self.input, "")
        }
    }
}
