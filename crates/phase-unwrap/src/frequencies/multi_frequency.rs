//! Unwrapping with several frequencies: hypotheses for each pixel, and a choice among them.

use range_image::{Modulation, Raster};
use rayon::prelude::*;

use crate::frequencies::frame::Planes;
use crate::frequencies::kernel_density::{KernelDensityOptions, RowWindow};
use crate::frequencies::lattice::Lattice;
use crate::tree::cycle::all_into_cycle;
use crate::{Error, Result};

/// Rows that one thread takes at a time. The rows beside them are searched as well, twice in all: the more rows, the fewer of
/// those; the fewer, the better the parts fit any number of threads.
const ROWS: usize = 32;

/// How several frequencies are unwrapped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MultiFrequencyOptions {
    /// Largest range searched, metres. `None`, the default: the combined ambiguity interval.
    pub maximum_range_m: Option<f64>,
    /// Standard deviation of the phase, radians, where none is given. Confidences are as good as it is. Default: 0.1
    /// rad.
    pub assumed_sigma_phase_rad: f32,
    /// How neighbours take part in the choice. `None`: each pixel decides alone. Default: that of
    /// [`KernelDensityOptions`].
    pub kernel: Option<KernelDensityOptions>,
}

impl Default for MultiFrequencyOptions {
    fn default() -> Self {
        Self { maximum_range_m: None, assumed_sigma_phase_rad: 0.1, kernel: Some(KernelDensityOptions::default()) }
    }
}

impl MultiFrequencyOptions {
    pub(crate) fn validate(&self, maximum_range_m: f64) -> Result<()> {
        let positive =
            [("maximum_range_m", maximum_range_m), ("assumed_sigma_phase_rad", self.assumed_sigma_phase_rad.into())];
        for (name, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfDomain { name, value, expected: "positive and finite" });
            }
        }
        self.kernel.map_or(Ok(()), KernelDensityOptions::validate)
    }
}

/// Wrap counts and combined ranges of several frequencies.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MultiUnwrapped {
    /// Whole cycles of each frequency: those that bring its phase nearest to `range`; 0 where there is no answer. A
    /// phase just below a full cycle at a range near zero has -1.
    pub wraps: Vec<Raster<i32>>,
    /// Inverse-variance mean of the ranges, metres; NaN where fewer than two phases are usable.
    pub range: Raster<f32>,
    /// Standard deviation of `range` in metres as the phases' sigmas propagate; NaN where these are not given.
    pub sigma: Raster<f32>,
    /// 0 (a guess, or no answer) to 1: `2p - 1` for the probability p of the range chosen among the hypotheses, lowered
    /// where it does not explain the phases.
    pub confidence: Raster<f32>,
}

impl MultiUnwrapped {
    /// Pixels without an answer, or whose confidence is below `minimum_confidence`: their range is a guess.
    pub fn unsure(&self, minimum_confidence: f32) -> Raster<bool> {
        let mut unsure = self.confidence.map(|&confidence| confidence < minimum_confidence);
        for (unsure, range) in unsure.as_mut_slice().iter_mut().zip(self.range.as_slice()) {
            *unsure |= range.is_nan();
        }
        unsure
    }
}

/// Finds the wrap counts of each pixel; see [`MultiUnwrapper::unwrap`]. Allocates its buffers anew.
///
/// # Errors
/// [`Error::TooFewFrequencies`], [`Error::EqualFrequencies`], [`Error::BeyondCombinedInterval`], [`Error::SearchTooLarge`],
/// [`Error::OutOfDomain`] for an option, [`Error::PlaneCount`] and [`Error::Raster`] where planes do not fit.
///
/// ```
/// use phase_unwrap::range_image::{Modulation, Raster};
/// use phase_unwrap::{MultiFrequencyOptions, unwrap_multi_frequency};
///
/// // 80 and 60 MHz repeat after 1.87 and 2.50 m, together after 7.5 m.
/// let modulations = [Modulation::new(80e6)?, Modulation::new(60e6)?];
/// let wrapped = |modulation: &Modulation| modulation.phase_from_range(5.0).rem_euclid(std::f64::consts::TAU) as f32;
/// let phases = [0, 1].map(|frequency| Raster::filled(8, 6, wrapped(&modulations[frequency])));
/// let found = unwrap_multi_frequency(&phases, &modulations, None, None, &MultiFrequencyOptions::default())?;
/// assert!((found.range[(4, 3)] - 5.0).abs() < 1e-4 && found.confidence[(4, 3)] > 0.9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn unwrap_multi_frequency(
    phases: &[Raster<f32>],
    modulations: &[Modulation],
    sigma_phase: Option<&[Raster<f32>]>,
    mask: Option<&Raster<bool>>,
    options: &MultiFrequencyOptions,
) -> Result<MultiUnwrapped> {
    MultiUnwrapper::new(modulations, *options)?.unwrap(phases, sigma_phase, mask)
}

/// Unwraps frames of the same frequencies one after the other and keeps its buffers.
#[derive(Debug, Clone)]
pub struct MultiUnwrapper {
    pub(crate) lattice: Lattice,
    pub(crate) kernel: Option<KernelDensityOptions>,
    /// One for each part of a frame.
    windows: Vec<RowWindow>,
}

impl MultiUnwrapper {
    /// Fails where frequencies or options lie outside their domain.
    pub fn new(modulations: &[Modulation], options: MultiFrequencyOptions) -> Result<Self> {
        let lattice = Lattice::new(modulations, &options)?;
        Ok(Self { lattice, kernel: options.kernel, windows: Vec::new() })
    }

    /// Wrap counts and ranges of a frame.
    ///
    /// `phases` are in radians of any cycle, one raster a frequency in the order of the modulations; `sigma_phase` their
    /// standard deviations, and where that is NaN or not positive the assumed one stands in. In `mask`, true means
    /// use. A phase that is not finite is left out; two at least are needed.
    ///
    /// For each count of the highest frequency the others take the counts nearest to its range. The misfit of such a
    /// hypothesis is the sum of squared, normalised residuals. The hypotheses with the smallest misfits are weighed
    /// against each other, with the neighbours' `[JaremoLawin2016]` unless switched off.
    pub fn unwrap(
        &mut self,
        phases: &[Raster<f32>],
        sigma_phase: Option<&[Raster<f32>]>,
        mask: Option<&Raster<bool>>,
    ) -> Result<MultiUnwrapped> {
        let mut out = MultiUnwrapped::default();
        self.unwrap_into(phases, sigma_phase, mask, &mut out)?;
        Ok(out)
    }

    /// As [`MultiUnwrapper::unwrap`], into an existing result of any size, which an error leaves as it was.
    pub fn unwrap_into(
        &mut self,
        phases: &[Raster<f32>],
        sigma_phase: Option<&[Raster<f32>]>,
        mask: Option<&Raster<bool>>,
        out: &mut MultiUnwrapped,
    ) -> Result<()> {
        let taken = all_into_cycle(phases);
        let planes = Planes::new(&taken, self.lattice.order.len(), sigma_phase, mask)?;
        out.resize(planes.size, phases.len());
        // Taken out, so that all parts can look at the rest.
        let mut windows = std::mem::take(&mut self.windows);
        let chosen = self.choose(&planes, &mut windows, out);
        self.windows = windows;
        chosen?;
        for (frequency, (wraps, phases)) in out.wraps.iter_mut().zip(phases).enumerate() {
            let part = ROWS * phases.width();
            let given = out.range.as_slice().par_chunks(part).zip(phases.as_slice().par_chunks(part));
            let wraps = wraps.as_mut_slice().par_chunks_mut(part).zip(given);
            wraps.for_each(|(wraps, (ranges, phases))| self.count_wraps(frequency, ranges, phases, wraps));
        }
        Ok(())
    }

    /// Ranges of a frame with their deviations and confidences.
    fn choose(&self, planes: &Planes<'_>, windows: &mut Vec<RowWindow>, out: &mut MultiUnwrapped) -> Result<()> {
        let ((width, height), reach) = (planes.size, self.reach());
        windows.resize_with(height.div_ceil(ROWS), RowWindow::default);
        let MultiUnwrapped { range, sigma, confidence, .. } = out;
        let [range, sigma, confidence] =
            [range, sigma, confidence].map(|plane| plane.as_mut_slice().par_chunks_mut(ROWS * width));
        let parts = windows.par_iter_mut().zip(range.zip(sigma.zip(confidence)));
        parts.enumerate().try_for_each(|(part, (window, (range, (sigma, confidence))))| {
            let (first, rows) = (part * ROWS, range.len() / width);
            self.begin_rows(width, window);
            for step in 0..rows + 2 * reach {
                match (first + step).checked_sub(reach).filter(|row| *row < height) {
                    Some(row) => {
                        let own = row.checked_sub(first).filter(|row| *row < rows);
                        let sigma = own.map(|row| &mut sigma[row * width..(row + 1) * width]);
                        self.take(planes, row * width, window, sigma);
                    }
                    None => self.take_empty_row(window),
                }
                if let Some(row) = step.checked_sub(2 * reach) {
                    let at = row * width..(row + 1) * width;
                    self.choose_row(window, &mut range[at.clone()], &mut confidence[at])?;
                }
            }
            Ok(())
        })
    }
}

impl MultiUnwrapped {
    fn resize(&mut self, (width, height): (usize, usize), frequencies: usize) {
        self.wraps.truncate(frequencies);
        self.wraps.resize_with(frequencies, Raster::default);
        for wraps in &mut self.wraps {
            resize(wraps, width, height, 0);
        }
        for plane in [&mut self.range, &mut self.sigma, &mut self.confidence] {
            resize(plane, width, height, f32::NAN);
        }
    }
}

/// A raster of this size; values are kept where the size is right already.
fn resize<T: Clone>(raster: &mut Raster<T>, width: usize, height: usize, value: T) {
    if (raster.width(), raster.height()) != (width, height) {
        *raster = Raster::filled(width, height, value);
    }
}
