use std::f32::consts::TAU;

use range_image::{ComplexChannel, Raster, with_wide_registers};

use crate::carried::attach::{Attaching, Block};
use crate::carried::coarse::Coarse;
use crate::carried::compare::Compared;
use crate::carried::options::{CarryOptions, CarrySummary, WholeFrame};
use crate::carried::pixels::{HELD, LANES, Limits, MASKED, OPEN, Row, carry_row};
use phase_unwrap::{Error, KnownWraps, SpatialOptions, Unwrapped, Unwrapper};

/// Share of the pixels that may be left without a count, and of pairs of neighbours that may look like one surface and differ in
/// their counts, as where a revealed surface was given that of another; beyond it the frame is checked at once.
const LEFT_SHARE: f32 = 1e-3;

/// Absolute counts of one frequency in a stream of frames, for a small part of what the tree costs.
///
/// Each pixel keeps the count that brings its phase nearest to that of the frame before, which is right where its range
/// changed by less than half an ambiguity interval. That is checked: the phase may step by half a radian, or four standard
/// deviations, and amplitude times range squared may not change beyond its noise. A pixel that fails takes the count of a
/// neighbour on the same surface. What passed wrongly, and what is left, is told by a small image of the frame (means of 4 by 4
/// pixels at 640 x 480) that the tree solves as a whole, every few frames and knowing nothing of those before: what looks like the
/// surface that it shows there, and contradicts it, takes its count. Every [`refresh_frames`](CarryOptions::refresh_frames), and where too
/// much fails, the tree solves the whole frame as [`Unwrapper`] does, to the bit.
///
/// A frame without a check allocates nothing.
#[derive(Debug, Default)]
pub struct CarriedUnwrapper {
    unwrapper: Unwrapper,
    options: SpatialOptions,
    carry: CarryOptions,
    out: Unwrapped,
    /// Noise of the last whole frame.
    noise: Option<f32>,
    coarse: Coarse,
    unwrapped: Vec<f32>,
    before: Vec<f32>,
    state: Vec<u8>,
    /// Blocks of pixels some of which failed, in the order of the image.
    blocks: Vec<Block>,
    open: Vec<u32>,
    spread: [Vec<f32>; 2],
    settled: Vec<(usize, u32)>,
    noise2: f32,
    /// Frames since the tree; `None` before the first.
    age: Option<u32>,
}

impl CarriedUnwrapper {
    /// Fails where an option lies outside its domain. `amplitude_noise` among the spatial options is given frame by frame.
    pub fn new(options: SpatialOptions, carry: CarryOptions) -> Result<Self, Error> {
        carry.validate()?;
        Ok(Self { unwrapper: Unwrapper::new(options)?, options, carry, ..Self::default() })
    }

    /// Other options for the frames to come, as after a new calibration; the counts of the frame before stay.
    ///
    /// Fails where an option lies outside its domain.
    pub fn set_options(&mut self, options: SpatialOptions) -> Result<(), Error> {
        options.validate()?;
        self.options = options;
        Ok(())
    }

    /// Forgets the frame before, as after a gap.
    pub fn restart(&mut self) {
        self.age = None;
    }

    /// The counts of the last frame; 0 where there is no phase.
    pub fn wraps(&self) -> &Raster<i32> {
        &self.out.wraps
    }

    /// Confidence in them, 0 to 1. Of a carried count it is that of the tree that found it.
    pub fn confidence(&self) -> &Raster<f32> {
        &self.out.confidence
    }

    /// Takes the next frame: a complex image with its phases, in `[0, 2 pi]`, and amplitudes. `noise` is asked for the standard deviation of
    /// each part of the complex image, in amplitude units, where the tree solves the whole frame; `None`: from the image.
    ///
    /// A frame of another size starts anew.
    ///
    /// # Errors
    /// As [`Unwrapper::unwrap`]; the frame before is forgotten then.
    pub fn unwrap_next(
        &mut self,
        channel: &ComplexChannel,
        phase: &Raster<f32>,
        amplitude: &Raster<f32>,
        noise: impl FnOnce() -> Option<f32>,
    ) -> Result<CarrySummary, Error> {
        phase.require_same_size(amplitude, "amplitude")?;
        phase.require_same_size(&channel.real, "real part")?;
        phase.require_same_size(&channel.imaginary, "imaginary part")?;
        let age = self.age.take().filter(|_| phase.require_same_size(&self.out.wraps, "counts before").is_ok());
        let mut summary = CarrySummary::default();
        let whole = match age {
            None => {
                self.resize(phase);
                Some(WholeFrame::First)
            }
            Some(age) if age + 1 >= self.carry.refresh_frames => Some(WholeFrame::Refresh),
            Some(_) => {
                self.carry(phase, amplitude, &mut summary);
                let most = self.carry.most_failed * summary.used as f32;
                (summary.failed as f32 > most).then_some(WholeFrame::Failed)
            }
        };
        summary.whole = whole;
        if whole.is_some() {
            self.solve_whole(phase, amplitude, noise())?;
            self.age = Some(0);
        } else {
            let frame = age.unwrap_or(0) + 1;
            self.mend(channel, [phase, amplitude], frame, &mut summary)?;
            self.age = Some(frame);
        }
        Ok(summary)
    }

    fn resize(&mut self, phase: &Raster<f32>) {
        let (width, height) = (phase.width(), phase.height());
        for plane in [&mut self.unwrapped, &mut self.before] {
            plane.clear();
            plane.resize(width * height, f32::NAN);
        }
        self.state.clear();
        self.state.resize(width * height, MASKED);
        self.spread = [vec![f32::NAN; width], vec![f32::NAN; width]];
        self.blocks.clear();
        self.blocks.reserve(width.div_ceil(LANES) * height);
        self.open.clear();
        self.open.reserve(width * height);
        self.settled.clear();
        self.settled.reserve(width);
        self.coarse.resize(width, height);
    }

    /// As the tree alone would, and what later frames need of it.
    fn solve_whole(&mut self, phase: &Raster<f32>, amplitude: &Raster<f32>, noise: Option<f32>) -> Result<(), Error> {
        self.unwrapper.set_options(SpatialOptions { amplitude_noise: noise, ..self.options });
        self.unwrapper.unwrap_into(phase, Some(amplitude), None, KnownWraps::Nothing, &mut self.out)?;
        let noise = self.unwrapper.amplitude_noise();
        self.noise2 = noise * noise;
        self.noise = Some(noise).filter(|noise| noise.is_finite() && *noise > 0.0);
        let pixels = phase.as_slice().iter().zip(amplitude.as_slice()).zip(self.out.wraps.as_slice());
        let planes = self.unwrapped.iter_mut().zip(&mut self.before).zip(&mut self.state);
        for (((unwrapped, before), state), ((&phase, &amplitude), &wraps)) in planes.zip(pixels) {
            *unwrapped = phase + TAU * wraps as f32;
            *before = amplitude;
            *state = if phase.is_finite() { HELD } else { MASKED };
        }
        self.coarse.forget_constant();
        Ok(())
    }

    /// Predicts and checks the counts of all pixels. What fails is attached to its neighbours a row later, while it is near.
    fn carry(&mut self, phase: &Raster<f32>, amplitude: &Raster<f32>, summary: &mut CarrySummary) {
        let mut blocks = std::mem::take(&mut self.blocks);
        blocks.clear();
        let mut swept = 0;
        for row in 0..phase.height() {
            let above = blocks.len();
            self.carry_row(row, phase, amplitude, &mut blocks, summary);
            self.attaching(phase, amplitude).sweep(&mut blocks[swept..above]);
            swept = above;
        }
        self.attaching(phase, amplitude).sweep(&mut blocks[swept..]);
        self.blocks = blocks;
    }

    fn carry_row(
        &mut self,
        row: usize,
        phase: &Raster<f32>,
        amplitude: &Raster<f32>,
        blocks: &mut Vec<Block>,
        summary: &mut CarrySummary,
    ) {
        let limits = Limits { noise2: self.noise2, maximum_wraps: f32::from(self.options.maximum_wraps) };
        let at = row * phase.width()..(row + 1) * phase.width();
        let first = at.start as u32;
        let mut row = Row {
            phase: &phase.as_slice()[at.clone()],
            amplitude: &amplitude.as_slice()[at.clone()],
            unwrapped: &mut self.unwrapped[at.clone()],
            before: &mut self.before[at.clone()],
            wraps: &mut self.out.wraps.as_mut_slice()[at.clone()],
            state: &mut self.state[at],
        };
        let tally = with_wide_registers(
            #[inline(always)]
            || carry_row(&mut row, first, limits, blocks),
        );
        summary.used += tally.used as usize;
        summary.failed += tally.failed as usize;
    }

    /// Finds the counts of the pixels that failed, and checks all of them when it is time to.
    fn mend(
        &mut self,
        channel: &ComplexChannel,
        [phase, amplitude]: [&Raster<f32>; 2],
        frame: u32,
        summary: &mut CarrySummary,
    ) -> Result<(), Error> {
        let (mut blocks, mut open) = (std::mem::take(&mut self.blocks), std::mem::take(&mut self.open));
        let [attached, at_edges, contested] = self.attaching(phase, amplitude).grow(&mut blocks, &mut open);
        summary.attached = attached;
        let least = LEFT_SHARE * summary.used as f32;
        let urgent = open.len() as f32 > least || contested as f32 > least;
        if urgent || frame.is_multiple_of(self.carry.check_frames) {
            let options = SpatialOptions { amplitude_noise: self.noise, ..self.options };
            if self.coarse.solve(channel, &options)? {
                self.compare(phase, amplitude, summary);
            }
            open.retain(|&pixel| self.state[pixel as usize] == OPEN);
        }
        summary.guessed = open.len() + at_edges;
        self.attaching(phase, amplitude).guess(&open);
        (self.blocks, self.open) = (blocks, open);
        Ok(())
    }

    fn compare(&mut self, phase: &Raster<f32>, amplitude: &Raster<f32>, summary: &mut CarrySummary) {
        let mut compared = Compared {
            phase,
            amplitude,
            state: &mut self.state,
            unwrapped: &mut self.unwrapped,
            before: &mut self.before,
            wraps: self.out.wraps.as_mut_slice(),
            confidence: self.out.confidence.as_mut_slice(),
            spread: &mut self.spread,
            settled: &mut self.settled,
            maximum_wraps: i32::from(self.options.maximum_wraps),
            noise2: self.noise2,
            minimum_confidence: self.options.minimum_confidence,
        };
        let outcome = compared.check(&self.coarse);
        (summary.checked, summary.doubted, summary.mended) = (true, outcome.doubted, outcome.mended);
    }

    fn attaching<'a>(&'a mut self, phase: &'a Raster<f32>, amplitude: &'a Raster<f32>) -> Attaching<'a> {
        Attaching {
            width: phase.width(),
            phase: phase.as_slice(),
            amplitude: amplitude.as_slice(),
            state: &mut self.state,
            unwrapped: &mut self.unwrapped,
            before: &mut self.before,
            wraps: self.out.wraps.as_mut_slice(),
            confidence: self.out.confidence.as_mut_slice(),
            noise2: self.noise2,
            maximum_wraps: i32::from(self.options.maximum_wraps),
        }
    }
}
