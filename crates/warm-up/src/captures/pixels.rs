//! Mean change of range of each frame, frame by frame: no more than one needs to be in memory.

use range_image::{RangeFrame, Raster};

use crate::{DriftError, DriftResult};

/// Most that a pixel may scatter about the change of all, as a multiple of its variance from frame to frame: what wanders is
/// then as large as the noise. A variance from n frames is known to `sqrt(2 / n)` of itself: over twenty frames
/// the ratio is three of these. A smaller one takes warming that differs from pixel to pixel for motion.
const LARGEST_VARIANCE_RATIO: f64 = 2.0;
/// Largest share of pixels that scatter more. A choice: with a larger share the mean change of the others is believed while
/// more of the scene moves, with a smaller one captures with a little motion are refused.
const LARGEST_MOVED_SHARE: f64 = 0.2;

/// Which pixels tell a change of range, and when a scene counts as at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangeOptions {
    /// Least share of the frames in which a pixel has an unflagged range. Default 99 %: the reference is the mean of
    /// all frames, so that single gaps shift nothing.
    pub least_valid_share: f64,
    /// Fewest such pixels. Default 20.
    pub least_pixels: usize,
    /// The ambiguity interval, metre, where ranges are wrapped to one: changes are taken modulo it. Default: `None`.
    pub interval_m: Option<f64>,
}

impl Default for ChangeOptions {
    fn default() -> Self {
        Self { least_valid_share: 0.99, least_pixels: 20, interval_m: None }
    }
}

impl ChangeOptions {
    /// A difference of ranges; within half of the interval about zero where there is one.
    fn difference(&self, a: f64, b: f64) -> f64 {
        match self.interval_m {
            Some(interval_m) => (a - b) - interval_m * ((a - b) / interval_m).round(),
            None => a - b,
        }
    }

    fn validate(&self) -> DriftResult<()> {
        let share = |value: f64| value > 0.0 && value <= 1.0;
        let interval_m = self.interval_m.unwrap_or(1.0);
        for (name, value, holds, expected) in [
            ("least_valid_share", self.least_valid_share, share(self.least_valid_share), "a share up to 1"),
            ("least_pixels", self.least_pixels as f64, self.least_pixels > 0, "at least one pixel"),
            ("interval_m", interval_m, interval_m.is_finite() && interval_m > 0.0, "a positive length"),
        ] {
            if !holds {
                return Err(DriftError::OutOfDomain { name, value, expected });
            }
        }
        Ok(())
    }
}

/// First pass: the mean range and the noise of each pixel.
#[derive(Debug, Clone)]
pub struct PixelMeans {
    options: ChangeOptions,
    size: [usize; 2],
    pixels: Vec<PixelSums>,
    frames: usize,
}

/// Sums of one pixel, as differences to its first range.
#[derive(Debug, Clone, Copy)]
struct PixelSums {
    index: usize,
    first: f64,
    before: f64,
    count: usize,
    sum: f64,
    /// Squares of the differences of successive ranges, which a drift does not reach.
    successive: f64,
}

impl PixelMeans {
    /// Frames of the mask's size; the pixels used are those where it is true.
    pub fn new(mask: &Raster<bool>, options: &ChangeOptions) -> DriftResult<Self> {
        options.validate()?;
        let none = |index| PixelSums { index, first: 0.0, before: 0.0, count: 0, sum: 0.0, successive: 0.0 };
        let used = mask.as_slice().iter().enumerate().filter(|(_, used)| **used);
        let pixels = used.map(|(index, _)| none(index)).collect();
        Ok(Self { options: *options, size: [mask.width(), mask.height()], pixels, frames: 0 })
    }

    /// Takes the next frame.
    pub fn add(&mut self, frame: &RangeFrame) -> DriftResult<()> {
        check(frame, self.frames, self.size)?;
        self.frames += 1;
        for pixel in &mut self.pixels {
            let Some(range) = valid(frame, pixel.index) else { continue };
            if pixel.count == 0 {
                (pixel.first, pixel.before) = (range, range);
            }
            pixel.sum += self.options.difference(range, pixel.first);
            pixel.successive += self.options.difference(range, pixel.before).powi(2);
            pixel.before = range;
            pixel.count += 1;
        }
        Ok(())
    }

    /// What the second pass measures by.
    ///
    /// # Errors
    /// [`DriftError::NoPixelsThroughout`] where too few pixels have ranges (and noise) in nearly all frames.
    pub fn finish(self) -> DriftResult<ChangeMeter> {
        let least = self.options.least_valid_share * self.frames as f64;
        // Noise that goes round a good part of the interval makes no mean.
        let largest = self.options.interval_m.map_or(f64::INFINITY, |interval_m| (interval_m / 8.0).powi(2));
        let reference = |pixel: &PixelSums| {
            let variance = pixel.successive / (2.0 * (pixel.count as f64 - 1.0));
            let usable = pixel.count as f64 >= least && variance > 0.0 && variance < largest;
            usable.then(|| PixelReference {
                index: pixel.index,
                range_m: pixel.first + pixel.sum / pixel.count as f64,
                variance,
                squares: 0.0,
                count: 0,
            })
        };
        let pixels: Vec<PixelReference> = self.pixels.iter().filter_map(reference).collect();
        let needed = self.options.least_pixels;
        if pixels.len() < needed {
            return Err(DriftError::NoPixelsThroughout { pixels: pixels.len(), needed });
        }
        Ok(ChangeMeter { options: self.options, size: self.size, pixels, frames: 0, changes: Vec::new() })
    }
}

/// Second pass: the change of each frame against the mean of all.
#[derive(Debug, Clone)]
pub struct ChangeMeter {
    options: ChangeOptions,
    size: [usize; 2],
    pixels: Vec<PixelReference>,
    frames: usize,
    /// Scratch: the changes of the pixels of one frame, in any order.
    changes: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct PixelReference {
    index: usize,
    range_m: f64,
    /// Of its noise, square metre.
    variance: f64,
    /// Sum of the squares about the change of all.
    squares: f64,
    count: usize,
}

/// By how much the ranges of one frame differ from the mean of all frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeChange {
    /// Mean over the pixels, each weighted by its noise, without those more than four deviations off the median, metre.
    pub mean_m: f64,
    /// Its standard deviation from the noise of the pixels, metre.
    pub sigma_m: f64,
}

/// Deviations of its noise beyond which a pixel takes no part in the mean of a frame. By chance one normal value in
/// sixteen thousand.
const GROSS: f64 = 4.0;

impl ChangeMeter {
    /// Number of pixels used.
    pub fn pixels(&self) -> usize {
        self.pixels.len()
    }

    /// The change of the next frame; the same frames in the same order as in the first pass.
    pub fn measure(&mut self, frame: &RangeFrame) -> DriftResult<RangeChange> {
        check(frame, self.frames, self.size)?;
        let index = self.frames;
        self.frames += 1;
        let options = self.options;
        let change = |pixel: &PixelReference| Some(options.difference(valid(frame, pixel.index)?, pixel.range_m));
        self.changes.clear();
        self.changes.extend(self.pixels.iter().filter_map(change));
        if self.changes.is_empty() {
            return Err(DriftError::EmptyFrame { index });
        }
        let median = statistics::upper_median(&mut self.changes);
        let (mut sum, mut weights) = (0.0, 0.0);
        for pixel in &self.pixels {
            let Some(change) = change(pixel) else { continue };
            if (change - median).powi(2) <= GROSS * GROSS * pixel.variance {
                sum += change / pixel.variance;
                weights += pixel.variance.recip();
            }
        }
        if weights <= 0.0 {
            return Err(DriftError::EmptyFrame { index });
        }
        let mean_m = sum / weights;
        for pixel in &mut self.pixels {
            if let Some(change) = change(pixel) {
                pixel.squares += (change - mean_m).powi(2);
                pixel.count += 1;
            }
        }
        Ok(RangeChange { mean_m, sigma_m: weights.sqrt().recip() })
    }

    /// Share of the pixels that wander from the change of all.
    ///
    /// # Errors
    /// [`DriftError::SceneMoves`] where they are too many.
    pub fn moved_share(&self) -> DriftResult<f64> {
        let limit = LARGEST_VARIANCE_RATIO;
        let moved = self.pixels.iter().filter(|pixel| pixel.squares > limit * pixel.variance * pixel.count as f64);
        let (share, limit) = (moved.count() as f64 / self.pixels.len() as f64, LARGEST_MOVED_SHARE);
        if share > limit { Err(DriftError::SceneMoves { share, limit }) } else { Ok(share) }
    }
}

fn valid(frame: &RangeFrame, index: usize) -> Option<f64> {
    let range = f64::from(frame.range.as_slice()[index]);
    (frame.flags.as_slice()[index].is_empty() && range.is_finite()).then_some(range)
}

fn check(frame: &RangeFrame, index: usize, expected: [usize; 2]) -> DriftResult<()> {
    frame.validate().map_err(|source| DriftError::Frame { index, source })?;
    let found = [frame.width(), frame.height()];
    if found == expected { Ok(()) } else { Err(DriftError::SizeDiffers { index, found, expected }) }
}
