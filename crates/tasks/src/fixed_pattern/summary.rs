//! Every figure of an estimation of a fixed pattern, by name.

use std::path::PathBuf;

use commands::Judged;
use sensor_noise::{PatternEstimate, PatternSplit, WallQuality};
use serde::Serialize;

use crate::fixed_pattern::{FixedPatternRequest, is_applied};

/// A fixed pattern, how well it is known, and whether it is worth applying.
#[derive(Debug, Clone, Serialize)]
pub struct FixedPatternSummary {
    /// The survey.
    pub survey: String,
    /// The calibration that was applied before.
    pub calibration: String,
    /// Whether the pattern raises the precision of held-out walls, in words.
    pub verdict: String,
    /// Whether it was written into the calibration.
    pub applied: bool,
    /// What was held out in turn: `stations` or `frames`.
    pub held_out: &'static str,
    /// In how many parts of neighbours: each by itself up to twenty.
    pub held_out_parts: usize,
    /// Root mean square of held-out residuals, averaged over the frames of a wall, metre.
    pub rms_without_m: f64,
    /// The same with the pattern of the others taken off.
    pub rms_with_m: f64,
    /// Root mean square of held-out residuals of single frames, metre.
    pub frame_rms_without_m: f64,
    /// The same with the pattern of the others taken off.
    pub frame_rms_with_m: f64,
    /// Student's t of the fall over blocks of pixels; `None` where there is no fall to test.
    pub statistic: Option<f64>,
    /// Blocks.
    pub blocks: usize,
    /// Probability of so large a statistic without a pattern.
    pub probability: Option<f64>,
    /// Pixels with an offset.
    pub pixels: usize,
    /// Root mean square of the offsets, metre.
    pub offset_rms_m: f64,
    /// Root mean square of their standard deviations, metre.
    pub deviation_rms_m: f64,
    /// Each frame.
    pub walls: Vec<PatternWall>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

impl Judged for FixedPatternSummary {}

/// How one frame shows its wall.
#[derive(Debug, Clone, Serialize)]
pub struct PatternWall {
    /// Station.
    pub station: String,
    /// Pixels on the wall.
    pub pixels: usize,
    /// Share of pixels elsewhere.
    pub outlier_share: f64,
    /// Root mean square of the residuals to the plane, metre.
    pub residual_rms_m: f64,
    /// Standard deviation of unit weight of the plane.
    pub sigma0: f64,
    /// What residuals of neighbours share, in sigmas of a pixel.
    pub systematic_sigmas: f64,
}

impl FixedPatternSummary {
    pub(crate) fn new(request: &FixedPatternRequest, calibration: &str, estimate: &PatternEstimate) -> Self {
        let test = &estimate.test;
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        Self {
            survey: request.survey.display().to_string(),
            calibration: calibration.to_owned(),
            verdict: test.verdict.to_string(),
            applied: is_applied(estimate),
            held_out: match test.split {
                PatternSplit::Stations => "stations",
                PatternSplit::Frames => "frames",
            },
            held_out_parts: test.parts,
            rms_without_m: test.rms_m[0],
            rms_with_m: test.rms_m[1],
            frame_rms_without_m: test.frame_rms_m[0],
            frame_rms_with_m: test.frame_rms_m[1],
            statistic: finite(test.statistic),
            blocks: test.blocks,
            probability: finite(test.probability),
            pixels: estimate.pixels,
            offset_rms_m: estimate.offset_rms_m,
            deviation_rms_m: estimate.deviation_rms_m,
            walls: estimate.frames.iter().map(PatternWall::new).collect(),
            seconds: 0.0,
            out: request.out.clone(),
        }
    }
}

impl PatternWall {
    fn new(quality: &WallQuality) -> Self {
        Self {
            station: quality.station.clone(),
            pixels: quality.pixels,
            outlier_share: quality.outlier_share,
            residual_rms_m: quality.residual_rms_m,
            sigma0: quality.sigma0,
            systematic_sigmas: quality.systematic_sigmas,
        }
    }
}
