//! Cuts the image at edges that may be real jumps: segments inside which relative wrap counts are safe.

use crate::image::cuts::{Cuts, HOOK, RIM};
use crate::image::surface::Surface;
use crate::tree::forest::{Forest, NO_LABEL};
use crate::tree::grid::{DOWN, Grid, RIGHT, wrap_step};
use crate::tree::reliability::EXPECTED;

/// Cost, rad^2, at which the count of a pixel in its segment is as good as a guess among two.
///
/// Measured on rooms with 0.01 to 1 rad of noise: a quarter of the counts are wrong at this cost, a hundredth at a quarter of
/// it. At half of it twice as many pixels in noise are unsure.
const GUESS_COST: f32 = 14.4;
/// The same at the rim of a segment, whose pixels bend by the edge beside them more than by noise: there, one count in a
/// hundred is wrong where second differences reach half a cycle.
const RIM_GUESS_COST: f32 = 45.0;

/// Segments of an image and how well each pixel sits in its own.
#[derive(Debug, Default)]
pub(crate) struct Segments {
    /// Reliability of the pixel's place in its segment, 0 to 1.
    pub hold: Vec<f32>,
    /// Pixels of each segment.
    pub pixels: Vec<u32>,
    cuts: Cuts,
}

impl Segments {
    /// Cuts the image, grows one tree a segment, and centres each segment's wrap counts on their mean.
    ///
    /// Only pixels without any cut edge conduct: one mixed pixel between object and background cannot join the two.
    /// The cost of rim pixels becomes infinite, which keeps them out of the forest.
    pub fn build(&mut self, grid: &Grid, surface: &Surface, cost: &mut [f32], forest: &mut Forest) {
        self.cuts.make(grid, surface);
        self.hold.clear();
        let pixels = cost.iter().zip(&surface.variance).zip(&self.cuts.class);
        self.hold.extend(pixels.map(|((&cost, &variance), class)| hold(cost, variance, *class == RIM)));
        for (cost, class) in cost.iter_mut().zip(&self.cuts.class) {
            *cost = if *class == RIM { f32::INFINITY } else { *cost };
        }
        forest.grow(grid, &surface.phase, cost, Some(&self.cuts.links), &[]);
        self.attach_rim(grid, surface, forest);
        self.centre(forest);
    }

    /// Hangs each rim pixel on the labelled neighbour that its phase and amplitude are nearest to, layer by layer.
    fn attach_rim(&self, grid: &Grid, surface: &Surface, forest: &mut Forest) {
        for &pixel in &self.cuts.rim {
            let pixel = pixel as usize;
            let mut best = (f32::INFINITY, pixel);
            for (from, bit, ahead) in [
                (pixel - grid.stride, DOWN, grid.stride),
                (pixel - 1, RIGHT, 1),
                (pixel, RIGHT, 1),
                (pixel, DOWN, grid.stride),
            ] {
                let other = if from == pixel { pixel + ahead } else { from };
                if self.cuts.links[from] & (bit << HOOK) == 0 || forest.label[other] == NO_LABEL {
                    continue;
                }
                let step = surface.step(from, from + ahead, ahead);
                // Amplitude varies on a surface (texture) more than the slope does: half its weight.
                let distance = step.phase + 0.5 * if step.amplitude.is_nan() { 0.0 } else { step.amplitude };
                if distance < best.0 {
                    best = (distance, other);
                }
            }
            let base = best.1;
            forest.label[pixel] = forest.label[base];
            forest.wraps[pixel] = forest.wraps[base] + wrap_step(surface.phase[base], surface.phase[pixel]);
        }
    }

    /// Shifts each segment so that zero is its mean count, rounded: the offset to find is then its typical count.
    fn centre(&mut self, forest: &mut Forest) {
        let mut sums = vec![(0_i64, 0_u32); forest.components];
        let labels = forest.label.chunk_by(|a, b| a == b);
        let mut wraps = forest.wraps.as_slice();
        // A segment's pixels come in runs: one addition a run.
        for run in labels {
            let (here, rest) = wraps.split_at(run.len());
            wraps = rest;
            if let Some(sum) = run.first().and_then(|&label| sums.get_mut(label as usize)) {
                let total: i64 = here.iter().map(|&wraps| i64::from(wraps)).sum();
                *sum = (sum.0 + total, sum.1 + run.len() as u32);
            }
        }
        self.pixels.clear();
        self.pixels.extend(sums.iter().map(|sum| sum.1));
        let means: Vec<i32> = sums.iter().map(|&(sum, n)| (sum as f64 / f64::from(n.max(1))).round() as i32).collect();
        for (&label, wraps) in forest.label.iter().zip(&mut forest.wraps) {
            *wraps -= means.get(label as usize).copied().unwrap_or(0);
        }
    }
}

/// Confidence, 0 to 1, in a pixel's place in its segment.
fn hold(cost: f32, variance: f32, at_rim: bool) -> f32 {
    let squares = if at_rim {
        // The noise counts twice, as in the cost of other pixels: once as it is expected, once as it is measured.
        (cost / RIM_GUESS_COST).powi(2) + (2.0 * EXPECTED * variance / GUESS_COST).powi(2)
    } else {
        (cost / GUESS_COST).powi(2)
    };
    1.0 / (1.0 + squares)
}
