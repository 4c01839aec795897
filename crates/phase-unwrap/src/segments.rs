//! Cuts the image at edges that may be real jumps: segments inside which relative wrap counts are safe.

use crate::SpatialOptions;
use crate::forest::{Forest, NO_LABEL};
use crate::grid::{DOWN, Grid, RIGHT, wrap_step};
use crate::reliability::reliability;
use crate::surface::{Step, Surface};

/// A pixel far from every cut.
const CORE: u8 = 1;
/// A pixel at a cut that hangs on a core.
const RIM: u8 = 2;
/// A pixel at a cut without a core beside it: wires, noise, mixed pixels.
const ORPHAN: u8 = 3;

/// Layers of rim around a core: two pixels are lost to each cut, one more holds mixed pixels.
const RIM_LAYERS: usize = 3;
/// Shift of a link bit that makes it a hook of a rim pixel, which the forest does not see.
const HOOK: u8 = 2;
/// Phase variance, rad^2, above which a pixel does not conduct: a step of pi is then within reach of the noise.
const CONDUCTING_VARIANCE: f32 = 0.5;

/// Segments of an image and how well each pixel sits in its own.
#[derive(Debug, Default)]
pub(crate) struct Segments {
    /// Reliability of the pixel's place in its segment, 0 to 1.
    pub hold: Vec<f32>,
    /// Pixels of each segment.
    pub pixels: Vec<u32>,
    /// Links that are not cut; later those inside segments only.
    links: Vec<u8>,
    class: Vec<u8>,
    /// Rim pixels, one layer after the other.
    rim: Vec<u32>,
    layers: Vec<usize>,
}

impl Segments {
    /// Cuts the image, grows one tree a segment, and centres each segment's wrap counts on their mean.
    ///
    /// Only pixels without any cut edge conduct: one mixed pixel between object and background cannot join the two.
    /// The cost of rim pixels becomes infinite, which keeps them out of the forest.
    pub fn build(
        &mut self,
        grid: &Grid,
        surface: &Surface,
        cost: &mut [f32],
        forest: &mut Forest,
        options: &SpatialOptions,
    ) {
        self.cut(grid, surface, options);
        self.classify(grid);
        self.keep_links_of_one_class(grid);
        self.hold.clear();
        self.hold.extend(cost.iter().map(|&cost| reliability(cost)));
        for (cost, _) in cost.iter_mut().zip(&self.class).filter(|(_, class)| **class == RIM) {
            *cost = f32::INFINITY;
        }
        forest.grow(grid, &surface.phase, cost, Some(&self.links));
        self.attach_rim(grid, surface, forest);
        self.centre(forest);
    }

    fn cut(&mut self, grid: &Grid, surface: &Surface, options: &SpatialOptions) {
        self.links.clear();
        self.links.resize(grid.len(), 0);
        self.class.clear();
        self.class.resize(grid.len(), 0);
        for pixel in grid.inner() {
            let open = surface.open_links(grid, pixel);
            if surface.used(pixel) {
                let class = if surface.variance[pixel] > CONDUCTING_VARIANCE { ORPHAN } else { CORE };
                self.class[pixel] = self.class[pixel].max(class);
            }
            for (bit, ahead) in [(RIGHT, 1), (DOWN, grid.stride)] {
                if open & bit == 0 {
                    continue;
                }
                if may_be_jump(surface.step(pixel, ahead), options) {
                    self.class[pixel] = ORPHAN;
                    self.class[pixel + ahead] = ORPHAN;
                } else {
                    self.links[pixel] |= bit;
                }
            }
        }
    }

    /// A pixel whose 3 x 3 surroundings hold a cut is no core, so that a gap of three edges in a cut border does not
    /// join two objects. Pixels that uncut links lead to from a core are its rim, layer by layer.
    fn classify(&mut self, grid: &Grid) {
        let stride = grid.stride;
        let around = [0, 1, 2, stride, stride + 2, 2 * stride, 2 * stride + 1, 2 * stride + 2];
        let cut: Vec<u32> = grid.inner().filter(|&p| self.class[p] == ORPHAN).map(|p| p as u32).collect();
        for &pixel in &cut {
            let corner = pixel as usize - stride - 1;
            for neighbour in around.map(|offset| corner + offset) {
                if self.class[neighbour] == CORE {
                    self.class[neighbour] = ORPHAN;
                }
            }
        }
        self.rim.clear();
        self.layers.clear();
        for layer in 0..RIM_LAYERS {
            self.layers.push(self.rim.len());
            for pixel in grid.inner() {
                let conducts = |n: usize| self.class[n] == CORE || (self.class[n] == RIM && layer > 0);
                if self.class[pixel] == ORPHAN && self.neighbours(grid, pixel).any(conducts) {
                    self.rim.push(pixel as u32);
                }
            }
            for &pixel in &self.rim[self.layers[layer]..] {
                self.class[pixel as usize] = RIM;
            }
        }
    }

    /// The neighbours that an uncut link leads to, in the order up, left, right, down.
    fn neighbours(&self, grid: &Grid, pixel: usize) -> impl Iterator<Item = usize> {
        let up = (self.links[pixel - grid.stride] & DOWN != 0).then_some(pixel - grid.stride);
        let left = (self.links[pixel - 1] & RIGHT != 0).then_some(pixel - 1);
        let right = (self.links[pixel] & RIGHT != 0).then_some(pixel + 1);
        let down = (self.links[pixel] & DOWN != 0).then_some(pixel + grid.stride);
        [up, left, right, down].into_iter().flatten()
    }

    /// Cores conduct to cores and orphans to orphans; what leads to a rim pixel becomes a hook for `attach_rim`.
    fn keep_links_of_one_class(&mut self, grid: &Grid) {
        for pixel in grid.inner() {
            for (bit, other) in [(RIGHT, pixel + 1), (DOWN, pixel + grid.stride)] {
                let kept = match (self.class[pixel], self.class[other]) {
                    (CORE, CORE) | (ORPHAN, ORPHAN) => bit,
                    (RIM, CORE | RIM) | (CORE, RIM) => bit << HOOK,
                    _ => 0,
                };
                if self.links[pixel] & bit != 0 {
                    self.links[pixel] = self.links[pixel] & !bit | kept;
                }
            }
        }
    }

    /// Hangs each rim pixel on the labelled neighbour that its phase and amplitude are nearest to, layer by layer.
    fn attach_rim(&self, grid: &Grid, surface: &Surface, forest: &mut Forest) {
        for &pixel in &self.rim {
            let pixel = pixel as usize;
            let mut best = (f32::INFINITY, pixel);
            for (from, bit, ahead) in [
                (pixel - grid.stride, DOWN, grid.stride),
                (pixel - 1, RIGHT, 1),
                (pixel, RIGHT, 1),
                (pixel, DOWN, grid.stride),
            ] {
                let other = if from == pixel { pixel + ahead } else { from };
                if self.links[from] & (bit << HOOK) == 0 || forest.label[other] == NO_LABEL {
                    continue;
                }
                let step = surface.step(from, ahead);
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
        for (&label, &wraps) in forest.label.iter().zip(&forest.wraps) {
            if label != NO_LABEL {
                let sum = &mut sums[label as usize];
                *sum = (sum.0 + i64::from(wraps), sum.1 + 1);
            }
        }
        self.pixels.clear();
        self.pixels.extend(sums.iter().map(|sum| sum.1));
        let means: Vec<i32> = sums.iter().map(|&(sum, n)| (sum as f64 / f64::from(n.max(1))).round() as i32).collect();
        for (&label, wraps) in forest.label.iter().zip(&mut forest.wraps) {
            if label != NO_LABEL {
                *wraps -= means[label as usize];
            }
        }
    }
}

fn may_be_jump(step: Step, options: &SpatialOptions) -> bool {
    let noise = 4.0 * step.sigma;
    // Relative amplitude noise equals phase noise, so the same margin serves both.
    step.phase > options.phase_jump_rad.max(noise) || step.amplitude > options.amplitude_jump + noise
}
