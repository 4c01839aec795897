//! Every figure of a registration by name; written as `summary.json` and shown as words.

use std::fmt;

use commands::tiles::TiledCloud;
use commands::{Doubt, Judged};
use serde::Serialize;

/// What was registered, and how well each pose is known.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RegisterSummary {
    /// `pairs` or `multi`.
    pub method: &'static str,
    /// What was named.
    pub inputs: Vec<String>,
    /// Where the start values came from.
    pub start: String,
    /// What fixes the common frame.
    pub datum: String,
    /// All stations with their poses.
    pub stations: Vec<RegisteredStation>,
    /// Pairs of stations that were held together.
    pub pairs: Vec<RegisteredPair>,
    /// Pairs of frames that overlap and were left out, each with its reason.
    pub refused: Vec<String>,
    /// How loops of pairs fail to close.
    pub loops: Vec<RegisteredLoop>,
    /// A-posteriori standard deviation of unit weight.
    pub sigma0: Option<f64>,
    /// Redundancy.
    pub redundancy: Option<i64>,
    /// Largest standard deviation of a station's position, metre.
    pub position_sigma_max_m: Option<f64>,
    /// Largest error of a station's position, where the truth is known, metre.
    pub position_error_max_m: Option<f64>,
    /// Largest error of a station's attitude, where the truth is known, degree.
    pub attitude_error_max_deg: Option<f64>,
    /// The cloud in tiles, where it has so many points that these take the place of `cloud.ply`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tiles: Option<TiledCloud>,
    /// What a reader should know before the poses are used.
    pub doubts: Vec<Doubt>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: String,
}

/// One station or frame.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredStation {
    /// Name.
    pub name: String,
    /// Usable points.
    pub points: usize,
    /// Position of the perspective centre (or origin) in the common frame, metre.
    pub position_m: [f64; 3],
    /// omega, phi, kappa, degree.
    pub attitude_deg: [f64; 3],
    /// Standard deviation of the position in space, metre; `None` for the datum or where it is not known.
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of the attitude about all axes, degree.
    pub attitude_sigma_deg: Option<f64>,
    /// Error of the position where the truth is known, metre.
    pub position_error_m: Option<f64>,
    /// Error of the attitude where the truth is known, degree.
    pub attitude_error_deg: Option<f64>,
    /// Motions that the surfaces do not determine.
    pub undetermined: Vec<String>,
    /// Whether what it sees agrees with what the other stations see, where that was judged.
    pub placement: Option<RegisteredPlacement>,
}

/// How a station agrees with the free space and the surfaces of the others, in sampled points.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredPlacement {
    /// `placed`, or `doubtful` where it is contradicted far more than the other stations are.
    pub verdict: &'static str,
    /// Part of what it and the others see in common that contradicts, between 0 and 1.
    pub contradicting: f64,
    /// How much that is, as a multiple of what is usual in the survey.
    pub times_usual: Option<f64>,
}

/// Two stations that see the same surfaces.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredPair {
    /// The station held.
    pub target: String,
    /// The station moved.
    pub source: String,
    /// Fraction of the source that has partners.
    pub overlap: f64,
    /// Root mean square distance of surfaces seen from both, metre.
    pub rms_m: f64,
    /// Mean signed distance of surfaces seen from both, metre, where it was measured.
    pub mean_m: Option<f64>,
    /// Motions that the pair by itself does not determine.
    pub undetermined: Vec<String>,
}

/// A loop of pairs.
#[derive(Debug, Clone, Serialize)]
pub struct RegisteredLoop {
    /// The stations, from the first back to it.
    pub stations: Vec<String>,
    /// Distance by which it fails to close, metre.
    pub translation_m: f64,
    /// Angle by which it fails to close, degree.
    pub rotation_deg: f64,
}

impl Judged for RegisterSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

impl fmt::Display for RegisteredPlacement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.1} %, {}", 100.0 * self.contradicting, self.verdict)
    }
}

impl RegisterSummary {
    /// Largest misclosure of a loop, metre and degree.
    pub(crate) fn largest_misclosure(&self) -> Option<(f64, f64)> {
        let worst = self.loops.iter().max_by(|a, b| a.translation_m.total_cmp(&b.translation_m))?;
        Some((worst.translation_m, worst.rotation_deg))
    }
}
