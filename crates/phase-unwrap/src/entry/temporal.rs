//! Sequences of frames: one tree over pixels and frames, or frame after frame from the counts before.

use range_image::Raster;

use crate::tree::cycle::{all_into_cycle, count_from_given};
use crate::tree::grid::{Grid, wrapped};
use crate::tree::seams::{Seam, cyclic_seams};
use crate::tree::unwrapped::Island;
use crate::{Error, KnownWraps, PhaseInput, Result, SpatialOptions, Unwrapped, Unwrapper};

/// Unwraps a sequence as one block: the spanning tree runs over the neighbours in the image and the same pixel in the
/// next frame. Give it recordings; for frames as they come there is [`StreamUnwrapper`].
///
/// `frames` are wrapped phases of one size, radians, of any cycle as in [`Unwrapper::unwrap`]; what is not finite is
/// masked in its frame, what is false in `mask` in all of them. A pixel's cost is that of its second differences, the one in time included; a link in
/// time costs in addition the square of its step, so that motion by more than a quarter of an ambiguity interval is
/// rather followed through the image. Counts are relative: the lowest of each island over all frames is 0. Islands are
/// those of the block, with the same labels in all frames; their pixels are counted frame by frame.
///
/// Fails as [`unwrap_spatial`](crate::unwrap_spatial) does, and where there is no frame. Needs about 90 bytes a pixel.
pub fn unwrap_sequence(
    frames: &[Raster<f32>],
    mask: Option<&Raster<bool>>,
    options: &SpatialOptions,
) -> Result<Vec<Unwrapped>> {
    let first = frames.first().ok_or(Error::NoFrames)?;
    for frame in frames {
        first.require_same_size(frame, "phase of a frame")?;
    }
    if let Some(mask) = mask {
        first.require_same_size(mask, "mask")?;
    }
    let block = Block::new(frames, first)?;
    let stack = block.stack(&all_into_cycle(frames), mask);
    let mut out = Unwrapped::default();
    Unwrapper::new(*options)?.unwrap_block(&block, &stack, &mut out)?;
    let unwrapped = |(index, phase): (usize, &Raster<f32>)| {
        let mut frame = block.frame(&out, index, options.minimum_confidence)?;
        let island = frame.island.as_slice();
        count_from_given(phase, |pixel| island[pixel] > 0, &mut frame.wraps);
        Ok(frame)
    };
    frames.iter().enumerate().map(unwrapped).collect()
}

/// Frames one below the other, a masked row between each two.
pub(crate) struct Block {
    pub grid: Grid,
    frames: usize,
    height: usize,
}

impl Block {
    fn new(frames: &[Raster<f32>], first: &Raster<f32>) -> Result<Self> {
        let (width, height) = (first.width(), first.height());
        if width == 0 || height == 0 {
            return Err(Error::Empty { width, height });
        }
        let rows = height.saturating_add(1).saturating_mul(frames.len()) - 1;
        Ok(Self { grid: Grid::new(width, rows)?, frames: frames.len(), height })
    }

    fn pitch(&self) -> usize {
        self.height + 1
    }

    fn stack(&self, frames: &[Raster<f32>], mask: Option<&Raster<bool>>) -> Raster<f32> {
        let mut stack = Raster::filled(self.grid.width, self.grid.height, f32::NAN);
        let blocks = stack.as_mut_slice().chunks_mut(self.grid.width * self.pitch());
        for (block, frame) in blocks.zip(frames) {
            for (index, (out, phase)) in block.iter_mut().zip(frame.as_slice()).enumerate() {
                *out = if mask.is_some_and(|mask| !mask.as_slice()[index]) { f32::NAN } else { *phase };
            }
        }
        stack
    }

    /// Padded indices of the pixels of all frames but the last `but`, frame by frame.
    fn pixels(&self, but: usize) -> impl Iterator<Item = usize> + use<> {
        let (grid, pitch, height) = (self.grid, self.pitch(), self.height);
        let rows = (0..self.frames.saturating_sub(but) * pitch).filter(move |row| row % pitch < height);
        rows.flat_map(move |row| (0..grid.width).map(move |col| grid.index(col, row)))
    }

    /// Elements from a pixel to the same in the next frame.
    fn ahead(&self) -> usize {
        self.pitch() * self.grid.stride
    }

    /// Adds the squares of the second differences in time.
    pub fn add_time(&self, phase: &[f32], cost: &mut [f32]) {
        let ahead = self.ahead();
        for before in self.pixels(2) {
            let [one, here, other] = [before, before + ahead, before + 2 * ahead];
            let second = wrapped(phase[one] - phase[here]) + wrapped(phase[other] - phase[here]);
            if !second.is_nan() {
                cost[here] += second * second;
            }
        }
    }

    /// Seams of cyclic axes in each frame, then the links in time.
    pub fn seams(&self, phase: &[f32], options: &SpatialOptions, seams: &mut Vec<Seam>) {
        cyclic_seams(&self.grid, [self.frames, self.height, self.pitch()], options.boundaries, seams);
        for pixel in self.pixels(1) {
            let other = pixel + self.ahead();
            let step = wrapped(phase[other] - phase[pixel]);
            if !step.is_nan() {
                seams.push(Seam { from: pixel as u32, to: other as u32, surcharge: step * step });
            }
        }
    }

    /// One frame of the block's result.
    fn frame(&self, block: &Unwrapped, frame: usize, minimum_confidence: f32) -> Result<Unwrapped> {
        let start = frame * self.pitch() * self.grid.width;
        let range = start..start + self.height * self.grid.width;
        let mut out = Unwrapped {
            wraps: self.cut(&block.wraps.as_slice()[range.clone()])?,
            confidence: self.cut(&block.confidence.as_slice()[range.clone()])?,
            island: self.cut(&block.island.as_slice()[range.clone()])?,
            segment: self.cut(&block.segment.as_slice()[range])?,
            islands: vec![Island { segments: 1, ..Island::default() }; block.islands.len()],
            typical_amplitude_at_interval: None,
        };
        out.count_pixels(minimum_confidence);
        Ok(out)
    }

    fn cut<T: Copy>(&self, values: &[T]) -> Result<Raster<T>> {
        Ok(Raster::from_vec(self.grid.width, self.height, values.to_vec())?)
    }
}

/// Unwraps frames as they come: each frame's counts start from those of the frame before.
///
/// A surface keeps its count, or moves it by the cycle that its phase passed, as long as its range changes by less than
/// half an ambiguity interval from frame to frame; each segment (with amplitudes) or island (without) follows what most
/// of its sure pixels say, so objects may move through the image.
#[derive(Debug, Default)]
pub struct StreamUnwrapper {
    unwrapper: Unwrapper,
    minimum_confidence: f32,
    phase: Option<Raster<f32>>,
    before: Unwrapped,
    now: Unwrapped,
}

impl StreamUnwrapper {
    /// Fails where an option lies outside its domain.
    pub fn new(options: SpatialOptions) -> Result<Self> {
        let minimum_confidence = options.minimum_confidence;
        Ok(Self { unwrapper: Unwrapper::new(options)?, minimum_confidence, ..Self::default() })
    }

    /// Forgets the frame before, as after a cut in the recording.
    pub fn restart(&mut self) {
        self.phase = None;
    }

    /// Unwraps the next frame. What `input` itself knows goes before the frame before, which then is left aside; a frame
    /// of another size starts anew. An error leaves the frame before as it was.
    pub fn unwrap_next(&mut self, input: &PhaseInput<'_>) -> Result<&Unwrapped> {
        let before = self.phase.as_ref().filter(|phase| phase.require_same_size(input.phase, "phase").is_ok());
        let known = match (input.known, before) {
            (KnownWraps::Nothing, Some(phase)) => {
                let minimum_confidence = self.minimum_confidence;
                KnownWraps::Previous { phase, unwrapped: &self.before, minimum_confidence }
            }
            (known, _) => known,
        };
        self.unwrapper.unwrap_input_into(&PhaseInput { known, ..*input }, &mut self.now)?;
        std::mem::swap(&mut self.before, &mut self.now);
        match &mut self.phase {
            Some(phase) if phase.len() == input.phase.len() && phase.width() == input.phase.width() => {
                phase.as_mut_slice().copy_from_slice(input.phase.as_slice());
            }
            other => *other = Some(input.phase.clone()),
        }
        Ok(&self.before)
    }
}
