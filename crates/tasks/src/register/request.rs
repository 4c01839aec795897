//! What a registration is asked for.

use std::path::PathBuf;

/// How the inputs are brought together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum RegisterMethod {
    /// Each input onto the one before it, pair by pair.
    #[default]
    Pairs,
    /// All at once: overlaps found, pairs aligned, then one adjustment of all surfaces.
    Multi,
}

impl RegisterMethod {
    /// The method's name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pairs => "pairs",
            Self::Multi => "multi",
        }
    }
}

/// What to register, and how.
#[derive(Debug, Clone)]
pub struct RegisterRequest {
    /// One survey folder, or two and more clouds of any format.
    pub inputs: Vec<PathBuf>,
    /// Approximate poses: `stations.csv`, a trajectory, or a 4 by 4 matrix for two clouds. `None`: those that come with
    /// the inputs, or else none, and the first alignment is sought without.
    pub guess: Option<PathBuf>,
    /// How the inputs are brought together.
    pub method: RegisterMethod,
    /// Calibration for the frames of a survey; `None`: `calibration.ron` beside it, where there is one.
    pub calibration: Option<PathBuf>,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}
