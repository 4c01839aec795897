//! Rows of a frame unwrapped one after the other, each as soon as its neighbours are known: what is found of a row is used
//! while it is near, by the choice and by whatever the caller does next.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::TAU;

use range_image::with_wide_registers;

use crate::frequencies::frame::Planes;
use crate::frequencies::kernel_density::{RANKS, RowWindow};
use crate::frequencies::lanes::{LANES, ROUNDER, scatter};
use crate::{MultiUnwrapper, Result};

/// More whole cycles between phase and range are no count: single-precision phases say nothing there.
const MOST_CYCLES: f32 = 2_097_152.0;

/// A row of a frame: one slice a frequency, in the order of the modulations.
#[derive(Debug, Clone, Copy)]
pub struct PhaseRow<'a> {
    /// Phases in `[0, 2 pi]`; one that is not finite is left out.
    pub phases: &'a [&'a [f32]],
    /// Their standard deviations, radian; where one is NaN or not positive the assumed one stands in.
    pub sigmas: &'a [&'a [f32]],
    /// Pixels that are used.
    pub mask: &'a [bool],
}

/// Rows one after the other give what [`MultiUnwrapper::unwrap`] does, to the bit. Into a window of its own, each part of a frame
/// takes its rows and [`Self::reach`] rows more on either side, empty ones beyond the image; from the `2 reach + 1`th on, the row
/// `reach` before the one taken last can be chosen.
impl MultiUnwrapper {
    /// Rows on either side that take part in the choice.
    pub fn reach(&self) -> usize {
        self.kernel.map_or(0, |kernel| usize::from(kernel.radius))
    }

    /// Makes a window ready for rows of `width` pixels. Allocates only where it was another before.
    pub fn begin_rows(&self, width: usize, window: &mut RowWindow) {
        window.resize(width, self.lattice.intervals_m[0] as f32, self.kernel);
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// [`Error::PlaneCount`](crate::Error::PlaneCount) and [`Error::Raster`](crate::Error::Raster) for slices that do not fit.
    pub fn take_row(&self, row: &PhaseRow<'_>, window: &mut RowWindow) -> Result<()> {
        let planes = Planes::of_row(row, self.lattice.order.len(), window.width())?;
        self.take(&planes, 0, window, None);
        Ok(())
    }

    /// Takes a row beyond the image.
    pub fn take_empty_row(&self, window: &mut RowWindow) {
        window.next_mut().1.fill(0.0);
    }

    /// Takes the row of pixels from `first` on; the standard deviations of its ranges are asked for where it is not for the
    /// neighbours only.
    pub(crate) fn take(&self, planes: &Planes<'_>, first: usize, window: &mut RowWindow, sigma: Option<&mut [f32]>) {
        let (width, lattice) = (window.width(), &self.lattice);
        let (layout, lines) = window.next_mut();
        let sigma = sigma.unwrap_or_default();
        with_wide_registers(
            #[inline(always)]
            || {
                for col in (0..width).step_by(LANES) {
                    let count = LANES.min(width - col);
                    let found = lattice.search::<RANKS>(planes, first + col, count, false);
                    layout.store(lines, col, &found);
                    if !sigma.is_empty() {
                        scatter(sigma, col, count, &found.known_sigma_m);
                    }
                }
            },
        );
    }

    /// Chooses the ranges of the row in the middle of those taken last, with their confidences.
    ///
    /// # Errors
    /// [`Error::Raster`](crate::Error::Raster) for slices that are not one row.
    pub fn choose_row(&self, window: &RowWindow, range: &mut [f32], confidence: &mut [f32]) -> Result<()> {
        let width = window.width();
        if let Some(found) = [range.len(), confidence.len()].into_iter().find(|found| *found != width) {
            return Err(range_image::Error::RasterLength { width, height: 1, expected: width, found }.into());
        }
        with_wide_registers(
            #[inline(always)]
            || {
                for col in (0..width).step_by(LANES) {
                    let count = LANES.min(width - col);
                    let chosen = window.choose(col);
                    scatter(range, col, count, &chosen.range_m);
                    scatter(confidence, col, count, &chosen.confidence);
                }
            },
        );
        Ok(())
    }

    /// Counts of one frequency (in the order of the modulations) that bring its phases nearest to ranges; 0 where there is none.
    pub fn count_wraps(&self, frequency: usize, ranges: &[f32], phases: &[f32], wraps: &mut [i32]) {
        let Some(place) = self.lattice.order.iter().position(|one| *one == frequency) else { return };
        let rate = (1.0 / self.lattice.intervals_m[place]) as f32;
        with_wide_registers(
            #[inline(always)]
            || {
                for ((wraps, range), phase) in wraps.iter_mut().zip(ranges).zip(phases) {
                    let cycles = range * rate - phase * (1.0 / TAU);
                    // The last bits of the sum are the number itself.
                    let count = (cycles + ROUNDER).to_bits().wrapping_sub(ROUNDER.to_bits()) as i32;
                    *wraps = if cycles.abs() < MOST_CYCLES { count } else { 0 };
                }
            },
        );
    }
}
