//! What can be typed after `register`.

use std::path::{Path, PathBuf};

use clap::Args;
use tasks::{RegisterMethod, RegisterRequest, TrackRequest};

#[derive(Debug, Args)]
pub(crate) struct RegisterArguments {
    /// One survey folder, or two and more clouds (.ply, .pcd, .xyz, .vtk, .e57, ...).
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Start poses: stations.csv, a trajectory, or a 4 x 4 matrix from the second of two clouds to the first.
    /// Default: those that come with the input; without any, the alignment is sought from the clouds alone.
    /// With --track the pose of the first frame, from stations.csv or a trajectory.
    #[arg(long, short)]
    guess: Option<PathBuf>,
    /// All at once: find overlaps, align pairs, adjust all surfaces together. Default: each onto the one before it.
    #[arg(long)]
    multi: bool,
    /// Follow a moving camera through the frames of one survey, or of a folder of depth images (TUM RGB-D, 7-Scenes).
    #[arg(long, conflicts_with = "multi")]
    track: bool,
    /// calibration.ron for a survey; default: the one beside survey.ron, if there is one.
    #[arg(long, short)]
    calibration: Option<PathBuf>,
    /// Output folder; default: out/<name of the first input>-registered, or -tracked.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

/// What to do, as typed.
pub(crate) enum Request {
    Register(RegisterRequest),
    Track(TrackRequest),
    /// Several inputs to be tracked.
    SeveralToTrack,
}

impl RegisterArguments {
    pub(crate) fn request(mut self) -> Request {
        let first = self.inputs.first().map_or(Path::new(""), PathBuf::as_path);
        let mut name = first.file_stem().unwrap_or_default().to_owned();
        name.push(if self.track { "-tracked" } else { "-registered" });
        let out = self.out.unwrap_or_else(|| Path::new("out").join(name));
        let (guess, calibration) = (self.guess, self.calibration);
        if self.track {
            return match (self.inputs.pop(), self.inputs.is_empty()) {
                (Some(survey), true) => Request::Track(TrackRequest { survey, guess, calibration, out }),
                _ => Request::SeveralToTrack,
            };
        }
        let method = if self.multi { RegisterMethod::Multi } else { RegisterMethod::Pairs };
        Request::Register(RegisterRequest { inputs: self.inputs, guess, method, calibration, out })
    }
}
