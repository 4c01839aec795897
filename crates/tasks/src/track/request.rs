//! What tracking is asked for.

use std::path::PathBuf;

/// A survey whose frames are to be tracked.
#[derive(Debug, Clone)]
pub struct TrackRequest {
    /// The survey's folder, or a folder of depth images of TUM RGB-D or 7-Scenes.
    pub survey: PathBuf,
    /// Pose of the first frame: `stations.csv` or a trajectory, of which only that pose is used. `None`: that of the
    /// survey's own `stations.csv`, or else the first frame is the world.
    pub guess: Option<PathBuf>,
    /// Calibration; `None`: `calibration.ron` beside the survey, where there is one.
    pub calibration: Option<PathBuf>,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}
