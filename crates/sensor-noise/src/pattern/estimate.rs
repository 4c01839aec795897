//! A table of offsets, one for each pixel.

use camera_model::Camera;
use error_models::FixedPattern;

use super::held_out::HeldOutTest;
use super::mean::robust_mean;
use super::residuals::{Residuals, Walls};
use super::{PatternOptions, WallCapture};
use crate::Result;

/// A fixed pattern, how well it is known, and whether it is worth applying.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternEstimate {
    /// Offset and deviation of each pixel. A pixel that no wall shows has the offset zero and the deviation NaN.
    pub pattern: FixedPattern,
    /// Pixels with an estimated offset.
    pub pixels: usize,
    /// Root mean square of the offsets, metre.
    pub offset_rms_m: f64,
    /// Root mean square of their deviations, metre.
    pub deviation_rms_m: f64,
    /// Whether the pattern raises the precision of walls that it was not estimated from.
    pub test: HeldOutTest,
    /// Each frame, in the order given.
    pub frames: Vec<WallQuality>,
}

/// How one frame shows its wall.
#[derive(Debug, Clone, PartialEq)]
pub struct WallQuality {
    /// Station.
    pub station: String,
    /// Pixels on the wall.
    pub pixels: usize,
    /// Share of pixels that lie elsewhere.
    pub outlier_share: f64,
    /// Root mean square of the residuals to its plane, metre.
    pub residual_rms_m: f64,
    /// Standard deviation of unit weight of the plane.
    pub sigma0: f64,
    /// What residuals of neighbours have in common, in sigmas of a pixel.
    pub systematic_sigmas: f64,
}

/// Estimates the range offset of each pixel from frames of flat walls, all other range errors taken off.
///
/// A plane of its own is fitted to each frame; what the pixels of a station leave on average is one value of each
/// pixel, and the robust mean over stations its offset. Offset, tilt and all else that a plane can take up stay with
/// the other terms. Where there is a single station its frames count as walls, and whatever belongs to the station
/// passes for a pattern: walls at several distances, seen by the camera turned, are better.
///
/// Then each station in turn is held out and freed of the pattern of the others: only if its residuals fall, the pattern
/// is worth applying.
///
/// # Errors
/// [`Error::TooFewFrames`](crate::Error::TooFewFrames) below two frames, and what
/// [`primitives::fit_primitive`] says of a wall that is none.
pub fn estimate_fixed_pattern(
    captures: &[WallCapture<'_>],
    camera: &Camera,
    options: &PatternOptions,
) -> Result<PatternEstimate> {
    options.validate()?;
    let walls = Walls::new(captures, camera, &options.wall)?;
    let test = HeldOutTest::new(&walls, camera.format.width, options);
    let found = pattern_of(&walls.averaged.iter().collect::<Vec<_>>());
    let known: Vec<usize> = (0..found.values_m.len()).filter(|index| found.values_m[*index].is_finite()).collect();
    let rms =
        |of: &dyn Fn(usize) -> f64| (known.iter().map(|index| of(*index)).sum::<f64>() / known.len() as f64).sqrt();
    Ok(PatternEstimate {
        pixels: known.len(),
        offset_rms_m: rms(&|index| found.values_m[index].powi(2)),
        deviation_rms_m: rms(&|index| found.variances[index]),
        pattern: FixedPattern {
            width: camera.format.width,
            height: camera.format.height,
            offset_m: found.values_m.iter().map(|value| if value.is_finite() { *value as f32 } else { 0.0 }).collect(),
            sigma_m: found.variances.iter().map(|variance| variance.sqrt() as f32).collect(),
        },
        test,
        frames: walls.quality,
    })
}

/// Robust mean over walls, pixel by pixel, with its variance; NaN where no wall shows the pixel.
pub(super) fn pattern_of(walls: &[&Residuals]) -> Residuals {
    let pixels = walls.first().map_or(0, |wall| wall.values_m.len());
    let mut out = Residuals { values_m: vec![f64::NAN; pixels], variances: vec![f64::NAN; pixels] };
    for index in 0..pixels {
        let values: Vec<(f64, f64)> = walls
            .iter()
            .map(|wall| (wall.values_m[index], wall.variances[index]))
            .filter(|(value, variance)| value.is_finite() && *variance > 0.0)
            .collect();
        if let Some((mean, sigma)) = robust_mean(&values) {
            (out.values_m[index], out.variances[index]) = (mean, sigma * sigma);
        }
    }
    out
}
