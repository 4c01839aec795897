//! What can be typed after `register`.

use std::path::{Path, PathBuf};

use clap::Args;
use pipeline::{RegisterMethod, RegisterRequest};

#[derive(Debug, Args)]
pub(crate) struct RegisterArguments {
    /// One survey folder, or two and more clouds (.ply, .pcd, .xyz, .vtk, .e57, ...).
    #[arg(required = true)]
    inputs: Vec<PathBuf>,
    /// Start poses: stations.csv, a trajectory, or a 4 x 4 matrix from the second of two clouds to the first.
    /// Default: those that come with the input; without any, the alignment is sought from the clouds alone.
    #[arg(long, short)]
    guess: Option<PathBuf>,
    /// All at once: find overlaps, align pairs, adjust all surfaces together. Default: each onto the one before it.
    #[arg(long)]
    multi: bool,
    /// calibration.ron for a survey; default: the one beside survey.ron, if there is one.
    #[arg(long, short)]
    calibration: Option<PathBuf>,
    /// Output folder; default: out/<name of the first input>-registered.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl RegisterArguments {
    pub(crate) fn request(self) -> RegisterRequest {
        let first = self.inputs.first().map_or(Path::new(""), PathBuf::as_path);
        let mut name = first.file_stem().unwrap_or_default().to_owned();
        name.push("-registered");
        RegisterRequest {
            out: self.out.unwrap_or_else(|| Path::new("out").join(name)),
            inputs: self.inputs,
            guess: self.guess,
            method: if self.multi { RegisterMethod::Multi } else { RegisterMethod::Pairs },
            calibration: self.calibration,
        }
    }
}
