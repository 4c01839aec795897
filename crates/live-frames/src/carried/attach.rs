//! Pixels without a count take that of a neighbour: of one on the same surface, or at last of any.

use range_image::Raster;

use crate::carried::pixels::{HELD, OPEN, RIM, apart, gentle_step};
use phase_unwrap::{wrap_step, wrapped};

/// Sweeps forth and back over the pixels without a count. What is revealed at the edge of a surface is reached in the first;
/// more follow bends.
const SWEEPS: usize = 4;

/// A frame whose open pixels are to be attached.
pub(crate) struct Attaching<'a> {
    pub phase: &'a Raster<f32>,
    pub amplitude: &'a Raster<f32>,
    pub state: &'a mut [u8],
    pub unwrapped: &'a mut [f32],
    pub before: &'a mut [f32],
    pub wraps: &'a mut [i32],
    pub confidence: &'a mut [f32],
    /// How often in a row each pixel was contradicted: with its count, a pixel takes over what speaks against it, so that a
    /// surface that moves through the image cannot escape.
    pub doubts: &'a mut [u8],
    pub noise2: f32,
    pub maximum_wraps: i32,
}

impl Attaching<'_> {
    /// Lists the open pixels, row by row.
    pub fn list(state: &[u8], open: &mut Vec<u32>) {
        open.clear();
        for (index, block) in state.chunks(32).enumerate() {
            if block.iter().fold(0, |any, &state| any | u8::from(state == OPEN)) != 0 {
                let pixels = block.iter().enumerate().filter(|(_, state)| **state == OPEN);
                open.extend(pixels.map(|(offset, _)| (32 * index + offset) as u32));
            }
        }
    }

    /// Attaches the listed pixels to neighbours on the same surface, and lists those apart; the others stay in the list. Gives
    /// the number of those at edges, which have a count for this frame only.
    pub fn grow(&mut self, open: &mut Vec<u32>, attached: &mut Vec<u32>) -> usize {
        attached.clear();
        for sweep in 0..SWEEPS {
            let before = open.len();
            if sweep % 2 == 0 {
                for &pixel in open.iter() {
                    self.attach(pixel as usize);
                }
            } else {
                for &pixel in open.iter().rev() {
                    self.attach(pixel as usize);
                }
            }
            open.retain(|&pixel| {
                let left = self.state[pixel as usize] == OPEN;
                if !left {
                    attached.push(pixel);
                }
                left
            });
            if open.is_empty() || open.len() == before {
                break;
            }
        }
        attached.iter().filter(|&&pixel| self.set_aside(pixel as usize)).count()
    }

    /// A pixel with a neighbour on another surface may belong to that one, or to neither, as slivers and mixed pixels do: it has
    /// its count for this frame, and says that it is a guess.
    fn set_aside(&mut self, pixel: usize) -> bool {
        let (phase, amplitude) = (self.phase.as_slice(), self.amplitude.as_slice());
        let unwrapped = |pixel: usize| phase[pixel] + std::f32::consts::TAU * self.wraps[pixel] as f32;
        let own = unwrapped(pixel);
        let beyond = |other: usize| match self.state[other] {
            HELD | RIM => apart([own, unwrapped(other)], [amplitude[pixel], amplitude[other]], self.noise2),
            state => state == OPEN,
        };
        let at_edge = self.sides(pixel).into_iter().flatten().any(beyond);
        if at_edge {
            self.state[pixel] = RIM;
            self.unwrapped[pixel] = f32::NAN;
            self.confidence[pixel] = 0.0;
        }
        at_edge
    }

    /// The neighbours of a pixel.
    fn sides(&self, pixel: usize) -> [Option<usize>; 4] {
        let (width, height) = (self.phase.width(), self.phase.height());
        let (col, row) = (pixel % width, pixel / width);
        [
            (row > 0).then(|| pixel - width),
            (col > 0).then(|| pixel - 1),
            (col + 1 < width).then(|| pixel + 1),
            (row + 1 < height).then(|| pixel + width),
        ]
    }

    /// Gives each listed pixel the count that continues its likeliest neighbour, whatever lies between them. Its confidence
    /// is 0, and the next frame does not rest on it.
    pub fn guess(&mut self, open: &[u32]) {
        for &pixel in open {
            let pixel = pixel as usize;
            let wraps = self.nearest(pixel, false).map_or(self.wraps[pixel], |(wraps, _)| wraps);
            self.wraps[pixel] = wraps.clamp(0, self.maximum_wraps);
            self.confidence[pixel] = 0.0;
            self.unwrapped[pixel] = f32::NAN;
            self.state[pixel] = RIM;
        }
    }

    fn attach(&mut self, pixel: usize) {
        if self.state[pixel] != OPEN {
            return;
        }
        if let Some((wraps, other)) = self.nearest(pixel, true)
            && (0..=self.maximum_wraps).contains(&wraps)
        {
            self.wraps[pixel] = wraps;
            self.confidence[pixel] = self.confidence[other];
            self.doubts[pixel] = self.doubts[other];
            self.unwrapped[pixel] = self.phase.as_slice()[pixel] + std::f32::consts::TAU * wraps as f32;
            self.before[pixel] = self.amplitude.as_slice()[pixel];
            self.state[pixel] = HELD;
        }
    }

    /// The count that continues the neighbour with the smallest step among those that hold (on the same surface, if so
    /// wished), and that neighbour.
    fn nearest(&self, pixel: usize, on_surface: bool) -> Option<(i32, usize)> {
        let (phase, amplitude) = (self.phase.as_slice(), self.amplitude.as_slice());
        let mut best = (f32::INFINITY, None);
        for other in self.sides(pixel).into_iter().flatten().filter(|&other| self.state[other] == HELD) {
            let phases = [phase[other], phase[pixel]];
            let step = if on_surface {
                gentle_step(phases, [amplitude[other], amplitude[pixel]], self.noise2).unwrap_or(f32::INFINITY)
            } else {
                wrapped(phases[1] - phases[0]).abs()
            };
            if step < best.0 {
                best = (step, Some(other));
            }
        }
        let other = best.1?;
        Some((self.wraps[other] + wrap_step(phase[other], phase[pixel]), other))
    }
}
