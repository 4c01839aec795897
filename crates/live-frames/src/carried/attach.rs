//! Pixels without a count take that of a neighbour: of one on the same surface, or at last of any.

use range_image::Raster;

use crate::carried::pixels::{HELD, OPEN, RIM, apart, is_gentle};
use phase_unwrap::{wrap_step, wrapped};

/// Sweeps forth and back over the pixels without a count. What is revealed at the edge of a surface is reached in the first;
/// more follow bends.
const SWEEPS: usize = 4;
/// Pixels among which an open one is looked for at once.
const BLOCK: usize = 32;

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
    /// The first sweep, of one row: attaches its open pixels, and lists those that are left and those apart. The rows above
    /// must be done, and the states of the next one known.
    pub fn sweep_row(&mut self, row: usize, open: &mut Vec<u32>, attached: &mut Vec<u32>) {
        let width = self.phase.width();
        for start in (row * width..(row + 1) * width).step_by(BLOCK) {
            let end = (start + BLOCK).min((row + 1) * width);
            if self.state[start..end].iter().fold(0, |any, &state| any | u8::from(state == OPEN)) == 0 {
                continue;
            }
            for pixel in start..end {
                if self.state[pixel] == OPEN {
                    self.attach(pixel);
                    let list = if self.state[pixel] == OPEN { &mut *open } else { &mut *attached };
                    list.push(pixel as u32);
                }
            }
        }
    }

    /// The other sweeps: attaches the listed pixels to neighbours on the same surface, and adds them to those attached; the others
    /// stay in the list. Gives the number of those at edges, which have a count for this frame only.
    pub fn grow(&mut self, open: &mut Vec<u32>, attached: &mut Vec<u32>) -> usize {
        for sweep in 1..SWEEPS {
            if open.is_empty() {
                break;
            }
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
            if open.len() == before {
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
        let mut at_edge = false;
        for other in self.sides(pixel) {
            let (state, brightness) = (self.state[other], [amplitude[pixel], amplitude[other]]);
            let known = state == HELD || state == RIM;
            at_edge |= state == OPEN || known && apart([own, unwrapped(other)], brightness, self.noise2);
        }
        if at_edge {
            self.state[pixel] = RIM;
            self.unwrapped[pixel] = f32::NAN;
            self.confidence[pixel] = 0.0;
        }
        at_edge
    }

    /// The neighbours of a pixel: above, to the left, to the right, below; the pixel itself where the image ends.
    fn sides(&self, pixel: usize) -> [usize; 4] {
        let (width, last) = (self.phase.width(), self.phase.len() - 1);
        // Half as wide, it is divided in half of the time; images have fewer pixels.
        let col = (pixel as u32 % width as u32) as usize;
        [
            if pixel >= width { pixel - width } else { pixel },
            if col > 0 { pixel - 1 } else { pixel },
            if col + 1 < width { pixel + 1 } else { pixel },
            if pixel + width <= last { pixel + width } else { pixel },
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
    /// wished), and that neighbour. The pixel itself does not hold.
    fn nearest(&self, pixel: usize, on_surface: bool) -> Option<(i32, usize)> {
        let (phase, amplitude) = (self.phase.as_slice(), self.amplitude.as_slice());
        let (own, brightness) = (phase[pixel], amplitude[pixel]);
        let mut best = None;
        let mut least = f32::INFINITY;
        for other in self.sides(pixel) {
            if self.state[other] != HELD {
                continue;
            }
            let step = wrapped(own - phase[other]).abs();
            if step < least && (!on_surface || is_gentle(step, [amplitude[other], brightness], self.noise2)) {
                (least, best) = (step, Some(other));
            }
        }
        best.map(|other| (self.wraps[other] + wrap_step(phase[other], own), other))
    }
}
