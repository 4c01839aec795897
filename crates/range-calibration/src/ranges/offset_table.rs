//! The offset of each pixel, or block of pixels, as a look-up table beside the constant d0 (Sects. 4.2 and 4.5).

use error_models::FixedPattern;
use range_image::ImageFormat;
use statistics::Distribution;

use crate::{Error, Result};

/// What a pixel of one capture was off by, after the correction by the other terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetSample {
    /// Observed minus corrected reference range, metre.
    pub residual_m: f64,
    /// Its standard deviation, metre.
    pub sigma_m: f64,
    /// Column and row of the pixel.
    pub pixel: [usize; 2],
}

/// Options of [`estimate_offset_table`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetTableOptions {
    /// Side of the blocks that share an offset, pixels. Default 1: each pixel has its own.
    pub block: usize,
    /// Blocks with fewer samples keep no offset. Default 4.
    pub least_samples: usize,
    /// Level of the test whether there is a pattern at all. Default 1 %.
    pub level: f64,
}

impl Default for OffsetTableOptions {
    fn default() -> Self {
        Self { block: 1, least_samples: 4, level: 0.01 }
    }
}

/// A table of offsets with its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct OffsetTable {
    /// The table, for [`correct_frame`](error_models::correct_frame); zero with a deviation of NaN where the offset is not known. Its mean over
    /// the known blocks, weighted as the samples are, is zero: d0 keeps its meaning.
    pub pattern: FixedPattern,
    /// Blocks with an offset.
    pub known_blocks: usize,
    /// Blocks with too few samples.
    pub unknown_blocks: usize,
    /// Root mean square of the offsets, chance taken off, metre.
    pub rms_m: f64,
    /// F test between and within the blocks: probability of offsets as different by chance.
    pub p_value: f64,
    /// Whether that is below the level: without it the table is noise, and better not applied.
    pub significant: bool,
}

/// Sums of one block.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    count: usize,
    weight: f64,
    sum: f64,
    squares: f64,
}

impl Block {
    fn mean(&self) -> f64 {
        self.sum / self.weight
    }
}

/// Estimates the offsets of pixels or blocks from residuals of several captures: weighted means, and their common mean
/// taken off.
///
/// The captures must see each pixel at different ranges and amplitudes, or what is left of the other terms goes into the
/// table. Pixels of one capture that share an error (of its pose) raise no alarm, as all blocks have it.
///
/// # Errors
/// [`Error::OutOfDomain`] for pixels outside the image, numbers that are none, and options that cannot be;
/// [`Error::TooFewDifferences`] where fewer than two blocks are known.
pub fn estimate_offset_table(
    samples: &[OffsetSample],
    format: &ImageFormat,
    options: &OffsetTableOptions,
) -> Result<OffsetTable> {
    format.validate()?;
    check(samples, format, options)?;
    let columns = format.width.div_ceil(options.block);
    let rows = format.height.div_ceil(options.block);
    let place = |[col, row]: [usize; 2]| row / options.block * columns + col / options.block;
    let mut blocks = vec![Block::default(); columns * rows];
    for sample in samples {
        let (block, weight) = (&mut blocks[place(sample.pixel)], sample.sigma_m.powi(-2));
        block.count += 1;
        block.weight += weight;
        block.sum += weight * sample.residual_m;
        block.squares += weight * sample.residual_m * sample.residual_m;
    }
    let is_known = |block: &Block| block.count >= options.least_samples;
    let known: Vec<Block> = blocks.iter().copied().filter(is_known).collect();
    if known.len() < 2 {
        let (differences, unknowns) = (samples.len(), 2 * options.least_samples);
        return Err(Error::TooFewDifferences { differences, unknowns });
    }
    let (weight, sum) = known.iter().fold((0.0, 0.0), |(w, s), block| (w + block.weight, s + block.sum));
    let mean = sum / weight;
    let p_value = between_and_within(&known, mean);
    let offset = |block: &Block| if is_known(block) { (block.mean() - mean) as f32 } else { 0.0 };
    let sigma = |block: &Block| {
        // The common mean was taken off.
        if is_known(block) { (1.0 / block.weight - 1.0 / weight).max(0.0).sqrt() as f32 } else { f32::NAN }
    };
    let pixels = || (0..format.width * format.height).map(|index| [index % format.width, index / format.width]);
    let scatter = known.iter().map(|block| (block.mean() - mean).powi(2) - (1.0 / block.weight - 1.0 / weight));
    Ok(OffsetTable {
        pattern: FixedPattern {
            width: format.width,
            height: format.height,
            offset_m: pixels().map(|pixel| offset(&blocks[place(pixel)])).collect(),
            sigma_m: pixels().map(|pixel| sigma(&blocks[place(pixel)])).collect(),
        },
        known_blocks: known.len(),
        unknown_blocks: blocks.len() - known.len(),
        rms_m: (scatter.sum::<f64>() / known.len() as f64).max(0.0).sqrt(),
        p_value,
        significant: p_value < options.level,
    })
}

/// One-way analysis of variance.
fn between_and_within(known: &[Block], mean: f64) -> f64 {
    let between: f64 = known.iter().map(|block| block.weight * (block.mean() - mean).powi(2)).sum();
    let within: f64 = known.iter().map(|block| (block.squares - block.sum * block.mean()).max(0.0)).sum();
    let (blocks, samples) = (known.len() as f64, known.iter().map(|block| block.count).sum::<usize>() as f64);
    let (numerator, denominator) = (blocks - 1.0, samples - blocks);
    let statistic = (between / numerator) / (within / denominator);
    Distribution::Fisher { numerator, denominator }.p_value(statistic)
}

fn check(samples: &[OffsetSample], format: &ImageFormat, options: &OffsetTableOptions) -> Result<()> {
    let refuse = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
    if options.block == 0 {
        return refuse("block", 0.0, "at least one pixel");
    }
    if options.least_samples < 2 {
        return refuse("least_samples", options.least_samples as f64, "at least two, which check each other");
    }
    if !(options.level > 0.0 && options.level < 1.0) {
        return refuse("level", options.level, "a probability between 0 and 1");
    }
    for sample in samples {
        let [col, row] = sample.pixel;
        if col >= format.width || row >= format.height {
            return refuse("column or row", col.max(row) as f64, "a pixel of the image");
        }
        if !sample.residual_m.is_finite() {
            return refuse("residual_m", sample.residual_m, "a finite number");
        }
        if !(sample.sigma_m > 0.0 && sample.sigma_m.is_finite()) {
            return refuse("sigma_m", sample.sigma_m, "a positive, finite standard deviation");
        }
    }
    Ok(())
}
