//! What can be typed behind `colour`.

use std::path::PathBuf;

use clap::Args;
use rig_tasks::ColourRequest;

use crate::requests::calibration::calibrate_arguments::default_out;

#[derive(Debug, Args)]
pub(crate) struct ColourArguments {
    /// Folder with `rig.ron`; the folders of its cameras are surveys with frames.
    rig: PathBuf,
    /// Station of both cameras: frames of one name are exposures of one moment.
    epoch: String,
    /// Folder that `calibrate` wrote of the rig; default: `mountings.csv` beside `rig.ron`, and the `calibration.ron` of each camera.
    #[arg(long, short, value_name = "RESULT")]
    calibration: Option<PathBuf>,
    /// Range camera whose points are coloured; default: the first one.
    #[arg(long, value_name = "CAMERA")]
    from: Option<String>,
    /// Camera whose images (PNG or JPEG) give the colours; default: the first one of images alone.
    #[arg(long, value_name = "CAMERA")]
    by: Option<String>,
    /// Output folder; default: out/<name of the rig>-coloured.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl ColourArguments {
    pub(crate) fn request(self) -> ColourRequest {
        let out = self.out.unwrap_or_else(|| default_out(&self.rig, "-coloured"));
        let Self { rig, epoch, calibration, from, by, .. } = self;
        ColourRequest { rig, epoch, calibration, from, by, out }
    }
}
