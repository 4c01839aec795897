//! What can be typed behind `live`.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use clap::Args;
use live_tasks::live_frames::DriftStage;
use live_tasks::live_frames::tracking::MapOptions;
use live_tasks::{LiveRequest, LiveSource, LiveTracking, StreamTarget};

use crate::requests::values::{finite, not_negative, positive};

/// Arguments of a stream.
#[derive(Debug, Args)]
pub(crate) struct LiveArguments {
    /// `-` (standard input), `tcp:HOST:PORT`, `unix:PATH`, a recording (folder with survey.ron, level samples, played at its own
    /// speed), any other folder (fills with files *.frame until there is one named `end`), or a file or named pipe.
    source: OsString,
    /// Folder whose survey.ron tells the camera; default: the recording's own.
    #[arg(long, short, value_name = "FOLDER")]
    survey: Option<PathBuf>,
    /// calibration.ron; default: the one beside survey.ron, if there is one.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Write clouds, complete PLY files one after the other, to a file, or with `-` to standard output.
    #[arg(long, value_name = "FILE|-")]
    ply: Option<PathBuf>,
    /// Write ranges, deviations, amplitudes and flags as images of an MCAP recording, to a file, or with `-` to standard output.
    #[arg(long, value_name = "FILE|-")]
    mcap: Option<PathBuf>,
    /// Seek the camera's pose frame by frame: in the status, the page, the clouds (whose points are then in the world, that of the first
    /// frame or of its station) and the recording (`/tf`). A frame that is lost has none.
    #[arg(long)]
    track: bool,
    /// Write the poses, line by line as they come (TUM: time tx ty tz qx qy qz qw), to a file, or with `-` to standard output; tracks.
    #[arg(long, value_name = "FILE|-")]
    trajectory: Option<PathBuf>,
    /// Write the map of what was seen as a PLY cloud with normals and sigma when the stream ends; tracks.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Edge of the map's voxels; they double whenever the map has a million points. Default: 0.05.
    #[arg(long, value_name = "METRE", value_parser = positive, requires = "map")]
    map_voxel: Option<f64>,
    /// End after so many processed frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Play a recording without waiting, and drop nothing: the source waits for the processing.
    #[arg(long)]
    fast: bool,
    /// Show range, amplitude, flags, points and the path on a page at this port of 127.0.0.1; 0: any that is free.
    #[arg(long, value_name = "PORT")]
    view: Option<u16>,
    /// Amplitude below which pixels are flagged, in the samples' unit.
    #[arg(long, value_name = "X", value_parser = not_negative)]
    low_amplitude: Option<f64>,
    /// No range is longer; default: 15, or the interval in which several frequencies together are unique.
    #[arg(long, value_name = "METRE", value_parser = positive)]
    maximum_range: Option<f64>,
    /// When the camera was switched on, on the clock of the frames' times; default: what the survey states.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    power_on: Option<f64>,
    /// Do not take a calibrated drift off.
    #[arg(long)]
    leave_drift: bool,
}

impl LiveArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> LiveRequest {
        let source = match self.source.to_str() {
            Some(name) => LiveSource::of_name(name),
            None => LiveSource::Path(self.source.into()),
        };
        let target = |path: PathBuf| {
            if path.as_os_str() == OsStr::new("-") { StreamTarget::StandardOutput } else { StreamTarget::File(path) }
        };
        let seeks = self.track || self.trajectory.is_some() || self.map.is_some();
        let defaults = MapOptions::default();
        let tracking = LiveTracking {
            trajectory: self.trajectory.map(target),
            map: self.map,
            map_options: MapOptions { voxel_m: self.map_voxel.unwrap_or(defaults.voxel_m), ..defaults },
        };
        LiveRequest {
            survey: self.survey,
            calibration: self.calibration,
            ply: self.ply.map(target),
            mcap: self.mcap.map(target),
            frames: self.frames,
            every_frame: self.fast,
            low_amplitude: self.low_amplitude,
            maximum_range_m: self.maximum_range,
            power_on_s: self.power_on,
            drift: if self.leave_drift { DriftStage::Ignore } else { DriftStage::Apply },
            view: self.view,
            tracking: seeks.then_some(tracking),
            ..LiveRequest::new(source)
        }
    }
}
