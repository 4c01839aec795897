//! Pixels without a count take that of a neighbour: of one on the same surface, or at last of any.

use range_image::Raster;

use crate::carried::pixels::{HELD, OPEN, RIM, distance};
use crate::tree::grid::wrap_step;

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
    pub noise2: f32,
    pub maximum_wraps: i32,
}

impl Attaching<'_> {
    /// Lists the open pixels, row by row.
    pub fn list(state: &[u8], open: &mut Vec<u32>) {
        open.clear();
        for (index, block) in state.chunks(32).enumerate() {
            if block.iter().fold(false, |any, &state| any | (state == OPEN)) {
                let pixels = block.iter().enumerate().filter(|(_, state)| **state == OPEN);
                open.extend(pixels.map(|(offset, _)| (32 * index + offset) as u32));
            }
        }
    }

    /// Attaches the listed pixels to neighbours on the same surface, and lists those apart; the others stay in the list.
    pub fn grow(&mut self, open: &mut Vec<u32>, attached: &mut Vec<u32>) {
        attached.clear();
        for sweep in 0..SWEEPS {
            let before = open.len();
            if sweep % 2 == 0 {
                for &pixel in open.iter() {
                    self.attach(pixel as usize, 1.0);
                }
            } else {
                for &pixel in open.iter().rev() {
                    self.attach(pixel as usize, 1.0);
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
        for &pixel in attached.iter() {
            self.set_aside(pixel as usize);
        }
    }

    /// A pixel with a neighbour on another surface may belong to that one, or to neither, as slivers and mixed pixels do: it has
    /// its count for this frame, and says that it is a guess.
    fn set_aside(&mut self, pixel: usize) {
        let (phase, amplitude) = (self.phase.as_slice(), self.amplitude.as_slice());
        let apart = |other: usize| {
            let off = distance([phase[other], phase[pixel]], [amplitude[other], amplitude[pixel]], self.noise2);
            match self.state[other] {
                HELD | RIM => off > 1.0,
                state => state == OPEN,
            }
        };
        if self.sides(pixel).into_iter().flatten().any(apart) {
            self.state[pixel] = RIM;
            self.unwrapped[pixel] = f32::NAN;
            self.confidence[pixel] = 0.0;
        }
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
            let (wraps, _) = self.nearest(pixel, f32::INFINITY).unwrap_or((self.wraps[pixel], 0.0));
            self.wraps[pixel] = wraps.clamp(0, self.maximum_wraps);
            self.confidence[pixel] = 0.0;
            self.unwrapped[pixel] = f32::NAN;
            self.state[pixel] = RIM;
        }
    }

    fn attach(&mut self, pixel: usize, limit: f32) {
        if self.state[pixel] != OPEN {
            return;
        }
        if let Some((wraps, confidence)) = self.nearest(pixel, limit)
            && (0..=self.maximum_wraps).contains(&wraps)
        {
            self.wraps[pixel] = wraps;
            self.confidence[pixel] = confidence;
            self.unwrapped[pixel] = self.phase.as_slice()[pixel] + std::f32::consts::TAU * wraps as f32;
            self.before[pixel] = self.amplitude.as_slice()[pixel];
            self.state[pixel] = HELD;
        }
    }

    /// The count that continues the nearest neighbour that holds, and that neighbour's confidence.
    fn nearest(&self, pixel: usize, limit: f32) -> Option<(i32, f32)> {
        let (phase, amplitude) = (self.phase.as_slice(), self.amplitude.as_slice());
        let mut best = (limit, None);
        for other in self.sides(pixel).into_iter().flatten().filter(|&other| self.state[other] == HELD) {
            let off = distance([phase[other], phase[pixel]], [amplitude[other], amplitude[pixel]], self.noise2);
            // Amplitudes that are not known leave the distance NaN, which is no neighbour.
            if off <= best.0 {
                let wraps = self.wraps[other] + wrap_step(phase[other], phase[pixel]);
                best = (off, Some((wraps, self.confidence[other])));
            }
        }
        best.1
    }
}
