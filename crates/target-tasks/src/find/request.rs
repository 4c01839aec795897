//! What is asked for.

use std::path::PathBuf;

use crate::kind::TargetKind;

/// Where to look for which targets.
#[derive(Debug, Clone)]
pub struct TargetsRequest {
    /// A survey of any level, or a folder of images of one camera (PNG, JPEG), each of them a station.
    pub survey: PathBuf,
    /// Calibration whose scattering is taken off, and that is handed on; `None`: the one beside the survey, if there is one.
    pub calibration: Option<PathBuf>,
    /// What is looked for.
    pub kind: TargetKind,
    /// Principal distance of a folder of images, pixel; `None`: from the perspective of the boards, which single targets do not have.
    pub principal_distance_px: Option<f64>,
    /// Standard deviation in each axis of the board's coordinates, and of those of `targets.csv` that have none, written into `targets.csv` as control, metre; `None`: none
    /// is written, and the coordinates are approximate.
    pub board_sigma_m: Option<f64>,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}
