//! Several frequencies: counts by each pixel's own phases and its neighbours', from the complex image to corrected points row by
//! row, so that no plane in between is written and read again.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use phase_unwrap::{
    CombinedPixels, MultiFrequencyOptions, MultiUnwrapper, PhaseRow, RowWindow, combine_pixels, combined_interval_m,
};
use range_image::{ComplexChannel, ComplexFrame, ComplexPixels, Flags, PolarPixels, with_wide_registers};
use scattering_deconvolution::ChannelRow;

use crate::calibration::FURTHEST_M;
use crate::camera::{LiveCamera, MOST_FREQUENCIES};
use crate::error::Result;
use crate::frame::ProcessedFrame;
use crate::stages::UnwrapStage;
use crate::work::ranges::{Channel, Rules, flag_unsure};
use crate::work::rows::{Chunk, for_each_chunk};

/// Standard deviation, metre, of what the ranges of one frequency carry besides noise when they are unwrapped, as in a
/// pipeline: range errors are taken off later and come to one or two centimetres.
const SYSTEMATIC_M: f64 = 0.02;
/// A frame is cut into at most so many parts, of so many rows at least. The rows beside a part are searched for its sake as well:
/// the more rows it has, the less of that; the more parts, the more threads they keep busy.
const MOST_PARTS: usize = 32;
const LEAST_ROWS: usize = 16;

/// What is kept from frame to frame.
#[derive(Debug)]
pub(crate) struct Several {
    unwrapper: MultiUnwrapper,
    rows: usize,
    parts: Vec<Part>,
}

/// Rows of one part of a frame while they are worked on.
#[derive(Debug, Clone)]
struct Part {
    window: RowWindow,
    /// Parts and deviations of the row that is taken.
    complex: [Vec<f32>; 3],
    /// Rows whose neighbours are not known yet, each in the place of its number's rest.
    waiting: Vec<Vec<Polar>>,
    /// Standard deviations of the phases by noise and by errors that are not taken off yet.
    noise: Vec<Vec<f32>>,
    mask: Vec<bool>,
    chosen: Vec<f32>,
    confidence: Vec<f32>,
    wraps: Vec<i32>,
    /// Corrected ranges of each frequency.
    ranges: Vec<Vec<f32>>,
    sigmas: Vec<Vec<f32>>,
    chi_squared: Vec<f32>,
}

/// A row of one frequency.
#[derive(Debug, Clone)]
struct Polar {
    phase: Vec<f32>,
    amplitude: Vec<f32>,
    /// Standard deviations of the phases.
    sigma: Vec<f32>,
}

impl Several {
    pub(crate) fn new(camera: &LiveCamera, stage: &UnwrapStage) -> Result<Self> {
        let maximum_range_m = match stage.maximum_range_m {
            Some(maximum_m) => maximum_m,
            None => combined_interval_m(&camera.modulations)?.min(FURTHEST_M),
        };
        let options = MultiFrequencyOptions { maximum_range_m: Some(maximum_range_m), ..Default::default() };
        let unwrapper = MultiUnwrapper::new(&camera.modulations, options)?;
        let rows = camera.height.div_ceil(MOST_PARTS).max(LEAST_ROWS);
        let part = Part::new(camera.width, camera.modulations.len(), unwrapper.reach());
        Ok(Self { unwrapper, rows, parts: vec![part; camera.height.div_ceil(rows)] })
    }

    pub(crate) fn finish(
        &mut self,
        complex: &ComplexFrame,
        rules: &Rules<'_>,
        frame: &mut ProcessedFrame,
    ) -> Result<()> {
        let unwrapper = &self.unwrapper;
        for_each_chunk(frame, self.rows, self.parts.iter_mut(), |chunk, part| {
            part.run(unwrapper, complex, rules, chunk)
        })
    }
}

impl Part {
    fn new(width: usize, frequencies: usize, reach: usize) -> Self {
        let row = vec![f32::NAN; width];
        let rows = vec![row.clone(); frequencies];
        let polar = Polar { phase: row.clone(), amplitude: row.clone(), sigma: row.clone() };
        Self {
            window: RowWindow::default(),
            complex: [row.clone(), row.clone(), row.clone()],
            waiting: vec![vec![polar; frequencies]; reach + 1],
            noise: rows.clone(),
            mask: vec![false; width],
            chosen: row.clone(),
            confidence: row.clone(),
            wraps: vec![0; width],
            ranges: rows.clone(),
            sigmas: rows,
            chi_squared: row,
        }
    }

    fn run(
        &mut self,
        unwrapper: &MultiUnwrapper,
        complex: &ComplexFrame,
        rules: &Rules<'_>,
        chunk: &mut Chunk<'_>,
    ) -> Result<()> {
        let (first, reach) = (chunk.first_row, unwrapper.reach());
        let (rows, height) = (chunk.range.len() / rules.width, complex.flags.height());
        unwrapper.begin_rows(rules.width, &mut self.window);
        for step in 0..rows + 2 * reach {
            match (first + step).checked_sub(reach).filter(|row| *row < height) {
                Some(row) => self.take(row, unwrapper, complex, rules)?,
                None => unwrapper.take_empty_row(&mut self.window),
            }
            if let Some(row) = step.checked_sub(2 * reach) {
                self.finish(row, unwrapper, complex, rules, chunk)?;
            }
        }
        Ok(())
    }

    /// Phases of a row, and what ranges they allow.
    fn take(
        &mut self,
        row: usize,
        unwrapper: &MultiUnwrapper,
        complex: &ComplexFrame,
        rules: &Rules<'_>,
    ) -> Result<()> {
        let width = self.mask.len();
        let place = row % self.waiting.len();
        let waiting = &mut self.waiting[place];
        let (mut phases, mut sigmas) = ([&[][..]; MOST_FREQUENCIES], [&[][..]; MOST_FREQUENCIES]);
        let planes = complex.channels.iter().zip(waiting).zip(&mut self.noise);
        let mut count = 0;
        for ((channel, Polar { phase, amplitude, sigma }), noise) in planes {
            for (to, plane) in self.complex.iter_mut().zip([&channel.real, &channel.imaginary, &channel.sigma]) {
                to.copy_from_slice(&plane.as_slice()[row * width..(row + 1) * width]);
            }
            let [real, imaginary, given] = &mut self.complex;
            rules.take_off_row([row, count], ChannelRow { real, imaginary, sigma: given });
            let out = PolarPixels { phase, amplitude, sigma };
            ComplexPixels { real, imaginary, sigma: given }.phase_amplitude_and_sigma_into(out, 1.0)?;
            add_systematics(channel, sigma, noise);
            (phases[count], sigmas[count]) = (phase, noise);
            count += 1;
        }
        for (mask, flags) in self.mask.iter_mut().zip(&complex.flags.as_slice()[row * width..]) {
            *mask = !flags.contains(Flags::NO_DATA);
        }
        let row = PhaseRow { phases: &phases[..count], sigmas: &sigmas[..count], mask: &self.mask };
        Ok(unwrapper.take_row(&row, &mut self.window)?)
    }

    /// From the choice of a row's ranges to its corrected points; `row` counts from the chunk's first.
    fn finish(
        &mut self,
        row: usize,
        unwrapper: &MultiUnwrapper,
        complex: &ComplexFrame,
        rules: &Rules<'_>,
        chunk: &mut Chunk<'_>,
    ) -> Result<()> {
        let (number, at) = (chunk.first_row + row, row * rules.width..(row + 1) * rules.width);
        let first = number * rules.width;
        let Self { window, waiting, chosen, confidence, wraps, ranges, sigmas, chi_squared, .. } = self;
        let waiting = &waiting[number % waiting.len()];
        unwrapper.choose_row(window, chosen, confidence)?;
        let flags = &mut chunk.flags[at.clone()];
        let given = &complex.flags.as_slice()[first..first + rules.width];
        flag_unsure(given, confidence, rules.minimum_confidence, flags);
        let out = ranges.iter_mut().zip(sigmas.iter_mut());
        let channels = complex.channels.iter().zip(waiting).zip(out);
        for (index, ((channel, Polar { phase, amplitude, sigma: sigma_phase }), (range, sigma))) in channels.enumerate()
        {
            unwrapper.count_wraps(index, chosen, phase, wraps);
            let (modulation, sigma_phase) = (channel.modulation, Some(&sigma_phase[..]));
            let channel = Channel { modulation, phase, wraps, amplitude, sigma_phase, range, sigma };
            channel.correct([number, index], rules, flags)?;
        }
        let (range, sigma) = (&mut chunk.range[at.clone()], &mut chunk.sigma[at.clone()]);
        let (mut given_ranges, mut given_sigmas) = ([&[][..]; MOST_FREQUENCIES], [&[][..]; MOST_FREQUENCIES]);
        given_ranges.iter_mut().zip(&*ranges).for_each(|(to, row)| *to = row);
        given_sigmas.iter_mut().zip(&*sigmas).for_each(|(to, row)| *to = row);
        let (given_ranges, given_sigmas) = (&given_ranges[..ranges.len()], &given_sigmas[..sigmas.len()]);
        combine_pixels(given_ranges, given_sigmas, CombinedPixels { range: &mut *range, sigma, chi_squared })?;
        if let Some(Polar { amplitude, .. }) = waiting.first() {
            chunk.amplitude[at.clone()].copy_from_slice(amplitude);
        }
        Ok(rules.rays.back_project_pixels(first, range, &mut chunk.points[at], flags)?)
    }
}

/// The hypotenuse of the noise and of range errors, to the last bit but one; not known where the noise is not.
fn add_systematics(channel: &ComplexChannel, sigma: &[f32], out: &mut [f32]) {
    let systematic = channel.modulation.phase_from_range(SYSTEMATIC_M) as f32;
    with_wide_registers(
        #[inline(always)]
        || {
            for (out, sigma) in out.iter_mut().zip(sigma) {
                *out = (sigma * sigma + systematic * systematic).sqrt();
            }
        },
    );
}
