//! A correction made ready once for many frames, row by row.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::sync::Arc;

use range_image::{Flags, ImageFormat, with_wide_registers};

use crate::correction::chunks::Chunk;
use crate::correction::correct::correct_chunk;
use crate::correction::interpolated::blend;
use crate::correction::kernel::{Kernel, LANES};
use crate::summary::Tally;
use crate::{Error, FixedPattern, InterpolatedModel, Result};

/// The range errors of one frequency and the fixed pattern, checked and ready for frames of one format.
///
/// What it takes off is what [`InterpolatedModel::correct_frame`] does, to the bit; it allocates nothing, checks nothing
/// twice and takes any rows of a frame, so that other work on them can follow while they are near.
pub struct PreparedCorrection {
    models: [Option<(Kernel, f64)>; 2],
    /// Of the longer of two models.
    weight: f64,
    format: ImageFormat,
    pattern: Option<Arc<FixedPattern>>,
}

/// Whole rows of a frame, one value a pixel.
#[derive(Debug)]
pub struct FrameRows<'a> {
    /// Ranges, metre, that are corrected in place.
    pub range: &'a mut [f32],
    /// Their standard deviations, metre, that are transported in place.
    pub sigma: &'a mut [f32],
    /// Amplitudes.
    pub amplitude: &'a [f32],
    /// Where pixels that the model does not cover get [`Flags::OUTSIDE_SPAN`].
    pub flags: &'a mut [Flags],
}

impl InterpolatedModel {
    /// Makes the correction ready for frames of one format; `principal_point_mm` and `pattern` as for
    /// [`Self::correct_frame`], which refuses the same.
    pub fn prepare(
        &self,
        format: &ImageFormat,
        principal_point_mm: [f64; 2],
        pattern: Option<Arc<FixedPattern>>,
    ) -> Result<PreparedCorrection> {
        format.validate()?;
        for coordinate in principal_point_mm {
            crate::error::require_finite("principal_point_mm", coordinate)?;
        }
        if let Some(pattern) = &pattern {
            pattern.validate()?;
            let (width, height, found_width, found_height) =
                (format.width, format.height, pattern.width, pattern.height);
            if (width, height) != (found_width, found_height) {
                let what = "fixed pattern";
                return Err(Error::Image(range_image::Error::SizeMismatch {
                    what,
                    width,
                    height,
                    found_width,
                    found_height,
                }));
            }
        }
        let ready = |model: &crate::RangeErrorModel| -> Result<(Kernel, f64)> {
            model.validate()?;
            Ok((Kernel::new(model, format, principal_point_mm), model.terms.d0))
        };
        let longer = self.longer.as_ref().map(|(model, _)| ready(model)).transpose()?;
        let weight = self.longer.as_ref().map_or(0.0, |(_, weight)| *weight);
        let mut prepared =
            PreparedCorrection { models: [Some(ready(&self.shorter)?), longer], weight, format: *format, pattern };
        prepared.set_drift(self.drift_m);
        Ok(prepared)
    }
}

impl PreparedCorrection {
    /// Sets the drift of a warming camera, metre, that is taken off beside d0; it was that of the model.
    pub fn set_drift(&mut self, drift_m: f64) {
        for (kernel, d0) in self.models.iter_mut().flatten() {
            kernel.d0 = *d0 + drift_m;
        }
    }

    /// The format of the frames.
    pub fn format(&self) -> &ImageFormat {
        &self.format
    }

    /// Corrects whole rows from `first_row` on.
    ///
    /// Fails where the slices are no whole rows, differ in length or reach beyond the frame; they are untouched then.
    pub fn correct_rows(&self, first_row: usize, mut rows: FrameRows<'_>) -> Result<()> {
        let (width, count) = (self.format.width, rows.range.len());
        let height = count / width;
        let end = first_row.saturating_add(height);
        let lengths = [rows.sigma.len(), rows.amplitude.len(), rows.flags.len(), height * width];
        if let Some(&found) = lengths.iter().find(|found| **found != count) {
            let expected = count;
            return Err(Error::Image(range_image::Error::RasterLength { width, height, expected, found }));
        }
        if end > self.format.height {
            let (what, found_width, found_height) = ("rows of the frame", width, end);
            let height = self.format.height;
            return Err(Error::Image(range_image::Error::SizeMismatch {
                what,
                width,
                height,
                found_width,
                found_height,
            }));
        }
        match &self.models {
            [Some((shorter, _)), Some((longer, _))] => self.blend_rows([shorter, longer], first_row, &mut rows),
            [Some((kernel, _)), _] => self.run(kernel, first_row, &mut rows),
            [None, _] => {}
        }
        Ok(())
    }

    fn run(&self, kernel: &Kernel, first_row: usize, rows: &mut FrameRows<'_>) {
        let start = first_row * self.format.width;
        let own = start..start + rows.range.len();
        let pattern = self.pattern.as_deref();
        let mut chunk = Chunk {
            first_row,
            range: rows.range,
            sigma: Some(rows.sigma),
            amplitude: rows.amplitude,
            flags: rows.flags,
            pattern: pattern.map(|pattern| &pattern.offset_m[own.clone()]),
            pattern_sigma: pattern.filter(|p| !p.sigma_m.is_empty()).map(|p| &p.sigma_m[own.clone()]),
            tally: Tally::default(),
        };
        with_wide_registers(
            #[inline(always)]
            || correct_chunk::<false>(&mut chunk, kernel, 0..self.format.width),
        );
    }

    /// Both models on a block of a row at a time, which needs no memory but the stack's.
    fn blend_rows(&self, [shorter, longer]: [&Kernel; 2], first_row: usize, rows: &mut FrameRows<'_>) {
        let width = self.format.width;
        let pattern = self.pattern.as_deref();
        let known = pattern.filter(|pattern| !pattern.sigma_m.is_empty());
        for row in 0..rows.range.len() / width {
            for column in (0..width).step_by(LANES) {
                let columns = column..(column + LANES).min(width);
                let here = row * width + columns.start..row * width + columns.end;
                let own = first_row * width + here.start..first_row * width + here.end;
                let count = here.len();
                let mut planes = [[[f32::NAN; LANES]; 2]; 2];
                let mut reasons = [[Flags::empty(); LANES]; 2];
                for (index, kernel) in [shorter, longer].into_iter().enumerate() {
                    let [range, sigma] = &mut planes[index];
                    range[..count].copy_from_slice(&rows.range[here.clone()]);
                    sigma[..count].copy_from_slice(&rows.sigma[here.clone()]);
                    let mut chunk = Chunk {
                        first_row: first_row + row,
                        range: &mut range[..count],
                        sigma: Some(&mut sigma[..count]),
                        amplitude: &rows.amplitude[here.clone()],
                        flags: &mut reasons[index][..count],
                        pattern: pattern.map(|pattern| &pattern.offset_m[own.clone()]),
                        pattern_sigma: known.map(|pattern| &pattern.sigma_m[own.clone()]),
                        tally: Tally::default(),
                    };
                    with_wide_registers(
                        #[inline(always)]
                        || correct_chunk::<false>(&mut chunk, kernel, columns.clone()),
                    );
                }
                let [[range, sigma], [other_range, other_sigma]] = &planes;
                for (lane, pixel) in here.enumerate() {
                    let mean = |a: f32, b: f32| blend(f64::from(a), f64::from(b), self.weight) as f32;
                    rows.range[pixel] = mean(range[lane], other_range[lane]);
                    rows.sigma[pixel] = mean(sigma[lane], other_sigma[lane]);
                    rows.flags[pixel] |= reasons[0][lane] | reasons[1][lane];
                }
            }
        }
    }
}
