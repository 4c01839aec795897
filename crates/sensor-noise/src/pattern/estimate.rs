//! A table of offsets, one for each pixel.

use camera_model::Camera;
use error_models::FixedPattern;
use range_image::RangeFrame;

use super::PatternOptions;
use super::held_out::HeldOutTest;
use super::residuals::Walls;
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

/// One frame of a flat wall, all other range errors taken off.
#[derive(Debug, Clone)]
pub struct WallCapture<'a> {
    /// Name of the station; frames of one station count as one wall.
    pub station: String,
    /// The frame.
    pub frame: &'a RangeFrame,
}

/// [`PatternEstimator`] of frames that are all at hand.
///
/// # Errors
/// As [`PatternEstimator`].
pub fn estimate_fixed_pattern(
    captures: &[WallCapture<'_>],
    camera: &Camera,
    options: &PatternOptions,
) -> Result<PatternEstimate> {
    let stations = captures.iter().map(|capture| capture.station.clone()).collect();
    let mut estimator = PatternEstimator::new(stations, camera, options)?;
    captures.iter().try_for_each(|capture| estimator.add(capture.frame))?;
    Ok(estimator.finish())
}

/// Estimates the range offset of each pixel from frames of flat walls, all other range errors taken off; it sees them one
/// after the other and keeps none.
///
/// A plane of its own is fitted to each frame; what the pixels of a station leave on average is one value of each
/// pixel, and the robust mean over stations its offset. Offset, tilt and all else that a plane can take up stay with
/// the other terms. Where there is a single station its frames count as walls, and whatever belongs to the station
/// passes for a pattern: walls at several distances, seen by the camera turned, are better.
///
/// Then each station in turn is held out and freed of the pattern of the others: only if its residuals fall, the pattern
/// is worth applying. Of more than twenty walls neighbours are held out together, in twenty parts. What is kept are sums of
/// each pixel of each wall; of more than 256 walls, or than 62 million pixels (200 walls of 640 x 480), neighbours count as one.
pub struct PatternEstimator {
    walls: Walls,
    camera: Camera,
    options: PatternOptions,
}

impl PatternEstimator {
    /// For frames of these stations, in the order in which they will come.
    ///
    /// # Errors
    /// [`Error::TooFewFrames`](crate::Error::TooFewFrames) below two frames, and for options out of their domain.
    pub fn new(stations: Vec<String>, camera: &Camera, options: &PatternOptions) -> Result<Self> {
        options.validate()?;
        let walls = Walls::new(stations, camera.format.width * camera.format.height)?;
        Ok(Self { walls, camera: *camera, options: *options })
    }

    /// What is kept until the end, and taken by the estimation then, byte.
    pub fn bytes(&self) -> u64 {
        self.walls.bytes()
    }

    /// The next frame.
    ///
    /// # Errors
    /// What [`primitives::fit_primitive`] says of a wall that is none; a frame more than there are stations.
    pub fn add(&mut self, frame: &RangeFrame) -> Result<()> {
        self.walls.add(frame, &self.camera, &self.options)
    }

    /// The pattern of the frames that were added.
    pub fn finish(self) -> PatternEstimate {
        let Self { walls, camera, options } = self;
        let test = HeldOutTest::new(&walls, camera.format.width, &options);
        let found = walls.pattern(|_| true);
        let known: Vec<(f64, f64)> = found.iter().copied().filter(|(offset_m, _)| offset_m.is_finite()).collect();
        let rms = |of: fn(&(f64, f64)) -> f64| {
            (known.iter().map(|pixel| of(pixel).powi(2)).sum::<f64>() / known.len() as f64).sqrt()
        };
        PatternEstimate {
            pixels: known.len(),
            offset_rms_m: rms(|pixel| pixel.0),
            deviation_rms_m: rms(|pixel| pixel.1),
            pattern: FixedPattern {
                width: camera.format.width,
                height: camera.format.height,
                offset_m: found
                    .iter()
                    .map(|(offset, _)| if offset.is_finite() { *offset as f32 } else { 0.0 })
                    .collect(),
                sigma_m: found.iter().map(|(_, sigma)| *sigma as f32).collect(),
            },
            test,
            frames: walls.quality,
        }
    }
}
