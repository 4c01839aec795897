//! The rangefinder's offset beyond a constant (Sect. 4.2): a look-up table from what the terms leave of all pixels that see
//! a plane.

use error_models::{FixedPattern, RangeErrorModel};
use range_calibration::{DifferenceOptions, OffsetSample, OffsetTable, OffsetTableOptions, estimate_offset_table};
use serde::Serialize;
use statistics::retain_within;

use crate::calibrate::planes::placed::Placed;
use crate::calibrate::start::Start;

/// Residuals beyond so many robust standard deviations belong to something else than the plane.
const GROSS: f64 = 4.0;

/// A table of offsets, how well it is known, and whether it is worth applying.
#[derive(Debug, Clone, Serialize)]
pub struct OffsetTableSummary {
    /// Side of the blocks that share an offset, pixels.
    pub block_px: usize,
    /// Blocks with an offset.
    pub known_blocks: usize,
    /// Blocks that too few pixels show.
    pub unknown_blocks: usize,
    /// Root mean square of the offsets, chance taken off, metre.
    pub offset_rms_m: f64,
    /// Root mean square of their standard deviations, metre.
    pub deviation_rms_m: f64,
    /// Probability of offsets as different by chance.
    pub p_value: f64,
    /// Whether it was written into the calibration.
    pub applied: bool,
    /// Why, or why not.
    pub verdict: String,
}

/// What was found.
pub(crate) struct FoundTable {
    pub(crate) pattern: FixedPattern,
    pub(crate) summary: OffsetTableSummary,
}

impl FoundTable {
    /// Estimates the table from these pixels of the captures (every one, if it is to be whole), with the terms of `model` taken off.
    pub(crate) fn new(
        placed: &[Placed<'_>],
        model: &RangeErrorModel,
        start: &Start,
        pixels: &DifferenceOptions,
        rewraps: bool,
        block: usize,
    ) -> Result<Self, range_calibration::Error> {
        let mut samples = Vec::new();
        for placed in placed {
            for sample in placed.samples(start, pixels, rewraps)? {
                let d = &sample.difference;
                let correction = model.correction(d.observed_range_m, d.x_mm, d.y_mm, d.amplitude);
                if !correction.outside_span {
                    let residual_m = d.observed_range_m - d.reference_range_m - correction.total_m();
                    // Places of whole pixels that went through millimetres.
                    let pixel = sample.pixel.map(|place| place.round() as usize);
                    samples.push(OffsetSample { residual_m, sigma_m: d.sigma_m, pixel });
                }
            }
        }
        retain_within(&mut samples, GROSS, |sample| sample.residual_m / sample.sigma_m);
        let options = OffsetTableOptions { block, ..OffsetTableOptions::default() };
        let first = estimate_offset_table(&samples, &start.camera.format, &options)?;
        let known_blocks = first.known_blocks;
        let pattern = with_mean(first.pattern, &samples);
        rescale(&mut samples, &pattern, known_blocks);
        let table = estimate_offset_table(&samples, &start.camera.format, &options)?;
        let summary = summarise(&table, block);
        Ok(Self { pattern: with_mean(table.pattern, &samples), summary })
    }

    /// What the calibration gets: no table is better than one of noise.
    pub(crate) fn worth_applying(&self) -> Option<FixedPattern> {
        self.summary.applied.then(|| self.pattern.clone())
    }
}

/// The table with the mean of all residuals in it: the terms, d0 among them, were found from some of the pixels only.
fn with_mean(mut table: FixedPattern, samples: &[OffsetSample]) -> FixedPattern {
    let place = |sample: &OffsetSample| sample.pixel[1] * table.width + sample.pixel[0];
    let known = samples.iter().filter(|sample| table.sigma_m[place(sample)].is_finite());
    let (weight, sum) = known.fold((0.0, 0.0), |(weight, sum), sample| {
        let own = sample.sigma_m.powi(-2);
        (weight + own, sum + own * sample.residual_m)
    });
    for (offset, _) in table.offset_m.iter_mut().zip(&table.sigma_m).filter(|(_, sigma)| sigma.is_finite()) {
        *offset += (sum / weight) as f32;
    }
    table
}

/// Standard deviations as the residuals bear them out once the table is taken off.
fn rescale(samples: &mut [OffsetSample], table: &FixedPattern, blocks: usize) {
    let offset = |[col, row]: [usize; 2]| f64::from(table.offset_m[row * table.width + col]);
    let left = samples.iter().map(|one| (one.residual_m - offset(one.pixel)) / one.sigma_m);
    let freedom = (samples.len() as f64 - blocks as f64).max(1.0);
    let scale = (left.map(|one| one * one).sum::<f64>() / freedom).sqrt();
    if scale > 0.0 {
        for sample in samples {
            sample.sigma_m *= scale;
        }
    }
}

fn summarise(table: &OffsetTable, block_px: usize) -> OffsetTableSummary {
    let known = || table.pattern.sigma_m.iter().filter(|sigma| sigma.is_finite()).map(|sigma| f64::from(*sigma));
    let deviation_rms_m = (known().map(|sigma| sigma * sigma).sum::<f64>() / known().count().max(1) as f64).sqrt();
    let applied = table.significant && table.rms_m > deviation_rms_m;
    let (rms, deviation) = (1e3 * table.rms_m, 1e3 * deviation_rms_m);
    let verdict = if applied {
        format!("offsets of {rms:.2} mm rms, known to {deviation:.2} mm: the table is part of the calibration")
    } else if table.significant {
        format!(
            "offsets of {rms:.2} mm rms, but known to {deviation:.2} mm only: a table would add more noise than it \
             takes off and was left out; more captures, or larger blocks, make it worth having"
        )
    } else {
        "offsets differ no more than by chance: no table was written, d0 is a constant".to_owned()
    };
    OffsetTableSummary {
        block_px,
        known_blocks: table.known_blocks,
        unknown_blocks: table.unknown_blocks,
        offset_rms_m: table.rms_m,
        deviation_rms_m,
        p_value: table.p_value,
        applied,
        verdict,
    }
}
