use std::f32::consts::TAU;

use range_image::{Raster, with_wide_registers};

use crate::carried::attach::Attaching;
use crate::carried::options::{CarryOptions, CarrySummary, WholeFrame};
use crate::carried::pixels::{DARK, Ends, HELD, Limits, MASKED, OPEN, Row, carry_row, contradictions};
use crate::carried::tiles::{TILE, Tiles};
use crate::carried::window::{Whole, Window, tile_pixels};
use crate::{KnownWraps, Result, SpatialOptions, Unwrapped, Unwrapper};

/// Absolute counts of one frequency in a stream of frames, for a few per cent of what the tree costs.
///
/// Each pixel keeps the count that brings its phase nearest to that of the frame before, which is right where its range
/// changed by less than half an ambiguity interval. That is checked: the phase may step by half a radian, or four standard
/// deviations, and amplitude times range squared may not change beyond its noise. A pixel that fails takes the count of a
/// neighbour on the same surface; where many are left in one place, the tree solves a window around them, knowing the counts
/// around and the brightness constant of the whole frame. What passed the check wrongly shows at its border: neighbours
/// that look like one surface with counts of two. Tiles where such links gather are solved as well. Every
/// [`refresh_frames`](CarryOptions::refresh_frames), and where too much fails, the tree solves the whole frame as
/// [`Unwrapper`] does, to the bit.
///
/// A frame whose counts are carried allocates nothing but what windows need.
#[derive(Debug, Default)]
pub struct CarriedUnwrapper {
    unwrapper: Unwrapper,
    options: SpatialOptions,
    carry: CarryOptions,
    out: Unwrapped,
    /// What windows are solved with: noise and constant of the last whole frame.
    window_options: SpatialOptions,
    window: Window,
    tiles: Tiles,
    unwrapped: Vec<f32>,
    before: Vec<f32>,
    state: Vec<u8>,
    open: Vec<u32>,
    attached: Vec<u32>,
    noise2: f32,
    /// Frames since the tree; `None` before the first.
    age: Option<u32>,
}

impl CarriedUnwrapper {
    /// Fails where an option lies outside its domain. `amplitude_noise` among the spatial options is given frame by frame.
    pub fn new(options: SpatialOptions, carry: CarryOptions) -> Result<Self> {
        carry.validate()?;
        Ok(Self { unwrapper: Unwrapper::new(options)?, options, carry, ..Self::default() })
    }

    /// Other options for the frames to come, as after a new calibration; the counts of the frame before stay.
    ///
    /// Fails where an option lies outside its domain.
    pub fn set_options(&mut self, options: SpatialOptions) -> Result<()> {
        options.validate()?;
        self.options = options;
        let SpatialOptions { amplitude_noise, albedo, .. } = self.window_options;
        self.window_options = SpatialOptions { amplitude_noise, albedo, ..options };
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

    /// Takes the next frame: phases in `[0, 2 pi]` and amplitudes, of one size. `noise` is asked for the standard deviation of
    /// each part of the complex image, in amplitude units, where the tree solves the whole frame; `None`: from the image.
    ///
    /// A frame of another size starts anew.
    ///
    /// # Errors
    /// As [`Unwrapper::unwrap`]; the frame before is forgotten then.
    pub fn unwrap_next(
        &mut self,
        phase: &Raster<f32>,
        amplitude: &Raster<f32>,
        noise: impl FnOnce() -> Option<f32>,
    ) -> Result<CarrySummary> {
        phase.require_same_size(amplitude, "amplitude")?;
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
            self.mend(phase, amplitude, frame, &mut summary)?;
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
        for list in [&mut self.open, &mut self.attached] {
            list.clear();
            list.reserve(width * height);
        }
        self.tiles.resize(width, height);
        self.window.resize(width, height);
    }

    /// As the tree alone would, and what later frames need of it.
    fn solve_whole(&mut self, phase: &Raster<f32>, amplitude: &Raster<f32>, noise: Option<f32>) -> Result<()> {
        self.unwrapper.set_options(SpatialOptions { amplitude_noise: noise, ..self.options });
        self.unwrapper.unwrap_into(phase, Some(amplitude), None, KnownWraps::Nothing, &mut self.out)?;
        let noise = self.unwrapper.amplitude_noise();
        self.noise2 = noise * noise;
        let mut albedo = self.options.albedo;
        albedo.typical_amplitude_at_interval = albedo
            .typical_amplitude_at_interval
            .or(self.out.typical_amplitude_at_interval.filter(|constant| constant.is_finite() && *constant > 0.0));
        let amplitude_noise = Some(noise).filter(|noise| noise.is_finite() && *noise > 0.0);
        self.window_options = SpatialOptions { albedo, amplitude_noise, ..self.options };
        let pixels = phase.as_slice().iter().zip(amplitude.as_slice()).zip(self.out.wraps.as_slice());
        let planes = self.unwrapped.iter_mut().zip(&mut self.before).zip(&mut self.state);
        for (((unwrapped, before), state), ((&phase, &amplitude), &wraps)) in planes.zip(pixels) {
            *unwrapped = phase + TAU * wraps as f32;
            *before = amplitude;
            *state = if phase.is_finite() { HELD } else { MASKED };
        }
        self.tiles.settle_all();
        Ok(())
    }

    /// Predicts and checks the counts of all pixels, and counts what contradicts.
    fn carry(&mut self, phase: &Raster<f32>, amplitude: &Raster<f32>, summary: &mut CarrySummary) {
        let width = phase.width();
        let limits = Limits { noise2: self.noise2, maximum_wraps: f32::from(self.options.maximum_wraps) };
        self.tiles.clear();
        let Self { unwrapped, before, state, out, tiles, .. } = self;
        with_wide_registers(
            #[inline(always)]
            || {
                for row in 0..phase.height() {
                    let at = row * width..(row + 1) * width;
                    let tally = carry_row(
                        Row {
                            phase: &phase.as_slice()[at.clone()],
                            amplitude: &amplitude.as_slice()[at.clone()],
                            unwrapped: &mut unwrapped[at.clone()],
                            before: &mut before[at.clone()],
                            wraps: &mut out.wraps.as_mut_slice()[at.clone()],
                            state: &mut state[at],
                        },
                        limits,
                    );
                    summary.used += tally.used as usize;
                    summary.failed += tally.open as usize;
                    let from = row.saturating_sub(1) * width;
                    let count = (row + 1) * width - from;
                    let rows = Ends {
                        phase: &phase.as_slice()[from..][..count],
                        unwrapped: &unwrapped[from..][..count],
                        amplitude: &amplitude.as_slice()[from..][..count],
                        state: &state[from..][..count],
                    };
                    count_contradictions(rows, [width, row], limits.noise2, tiles);
                }
            },
        );
        self.tiles.accept();
    }

    /// Finds the counts of the pixels that failed.
    fn mend(
        &mut self,
        phase: &Raster<f32>,
        amplitude: &Raster<f32>,
        frame: u32,
        summary: &mut CarrySummary,
    ) -> Result<()> {
        let width = phase.width();
        Attaching::list(&self.state, &mut self.open);
        let mut open = std::mem::take(&mut self.open);
        let mut attached = std::mem::take(&mut self.attached);
        let at_edges = self.attaching(phase, amplitude).grow(&mut open, &mut attached);
        self.attached = attached;
        summary.attached = summary.failed.saturating_sub(open.len());
        for &pixel in &open {
            let tile = self.tiles.of(pixel as usize, width);
            self.tiles.open[tile] += 1;
        }
        self.tiles.rank(frame);
        summary.windows = self.carry.windows.min(self.tiles.order.len());
        summary.waiting = self.tiles.order.len() - summary.windows;
        for turn in 0..summary.windows {
            let tile = self.tiles.order[turn];
            self.solve_tile(phase, amplitude, tile)?;
            self.tiles.settle(tile, frame);
        }
       open.retain(|&pixel| self.state[pixel as usize] == OPEN);
        summary.guessed = open.len() + at_edges;
        self.attaching(phase, amplitude).guess(&open);
        self.open = open;
        Ok(())
    }

    fn attaching<'a>(&'a mut self, phase: &'a Raster<f32>, amplitude: &'a Raster<f32>) -> Attaching<'a> {
        Attaching {
            phase,
            amplitude,
            state: &mut self.state,
            unwrapped: &mut self.unwrapped,
            before: &mut self.before,
            wraps: self.out.wraps.as_mut_slice(),
            confidence: self.out.confidence.as_mut_slice(),
            noise2: self.noise2,
            maximum_wraps: i32::from(self.options.maximum_wraps),
        }
    }

    fn solve_tile(&mut self, phase: &Raster<f32>, amplitude: &Raster<f32>, tile: usize) -> Result<()> {
        let width = phase.width();
        let place = [tile % self.tiles.columns, tile / self.tiles.columns];
        let whole = Whole { phase, amplitude, wraps: self.out.wraps.as_slice(), state: &self.state };
        if !self.window.solve(whole, place, &self.window_options)? {
            return Ok(());
        }
        let [columns, rows] = tile_pixels(place, width, phase.height());
        let [left, top] = self.window.corner;
        for row in rows {
            for col in columns.clone() {
                let (pixel, inside) = (row * width + col, (col - left, row - top));
                if self.state[pixel] == MASKED {
                    continue;
                }
                let wraps = self.window.out.wraps[inside];
                self.out.wraps.as_mut_slice()[pixel] = wraps;
                self.out.confidence.as_mut_slice()[pixel] = self.window.out.confidence[inside];
                self.unwrapped[pixel] = phase.as_slice()[pixel] + TAU * wraps as f32;
                self.before[pixel] = amplitude.as_slice()[pixel];
                self.state[pixel] = if self.state[pixel] == DARK { DARK } else { HELD };
            }
        }
        Ok(())
    }
}

/// Counts the links of a row that contradict, to the right and from the row above; `rows` begins with that one, if there is one.
#[inline(always)]
fn count_contradictions(rows: Ends<'_>, [width, row]: [usize; 2], noise2: f32, tiles: &mut Tiles) {
    let here = rows.phase.len() - width;
    for (column, tile) in (0..width).step_by(TILE).zip(row / TILE * tiles.columns..) {
        let count = TILE.min(width - column);
        let across = count.min(width - column - 1);
        let mut found = contradictions(rows.part(here + column, across), rows.part(here + column + 1, across), noise2);
        if row > 0 {
            found += contradictions(rows.part(column, count), rows.part(here + column, count), noise2);
        }
        tiles.contradictions[tile] += found;
    }
}
