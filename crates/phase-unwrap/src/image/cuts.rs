//! Where the image is cut at possible jumps, and which pixels conduct.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// No short cuts: comparing is cheaper than a branch, and only without branches go many pixels at once.
#![allow(clippy::needless_bitwise_bool)]

use range_image::with_wide_registers;

use crate::image::surface::Surface;
use crate::tree::grid::{DOWN, Grid, RIGHT, set_bits};
use crate::tree::steps::wrapped_steps;

/// A pixel far from every cut.
pub(crate) const CORE: u8 = 1;
/// A pixel at a cut that hangs on a core.
pub(crate) const RIM: u8 = 2;
/// A pixel at a cut without a core beside it: wires, noise, mixed pixels.
pub(crate) const ORPHAN: u8 = 3;
/// Shift of a link bit that makes it a hook of a rim pixel, which the forest does not see.
pub(crate) const HOOK: u8 = 2;

/// A step of the phase between neighbours that exceeds the slope around it by so much, rad (12 cm at 20 MHz), may be a jump;
/// four standard deviations where the noise is larger. Tuned on the rooms of `tests/absolute.rs` and `tests/dark_rooms.rs`:
/// where it is smaller, surfaces fall into more segments, where it is larger, objects close before a wall share its segment.
pub(crate) const PHASE_JUMP_RAD: f32 = 0.1;
/// A ratio of neighbouring amplitudes whose natural logarithm exceeds this may be a jump. Tuned on the same rooms: where it is
/// smaller, edges of albedo alone cut surfaces, where it is larger, surfaces a cycle apart and alike in phase stay joined.
const AMPLITUDE_JUMP: f32 = 0.35;
/// Layers of rim around a core: two pixels are lost to each cut, one more holds mixed pixels.
const RIM_LAYERS: usize = 3;
/// Phase variance, rad^2, above which a pixel does not conduct: a step of pi is then within reach of the noise. Four
/// standard deviations of a difference, `4 sqrt(2 * 0.5) = 4` rad, exceed it; a smaller limit takes dark surfaces
/// apart.
const CONDUCTING_VARIANCE: f32 = 0.5;

/// Links that are not cut, class of each pixel, and the rim.
#[derive(Debug, Default)]
pub(crate) struct Cuts {
    /// Uncut links; later those between pixels of one class, and hooks.
    pub links: Vec<u8>,
    pub class: Vec<u8>,
    /// Rim pixels, one layer after the other.
    pub rim: Vec<u32>,
    /// Links that are cut; later a plane of flags.
    cut: Vec<u8>,
    flags: Vec<u8>,
    along: Vec<f32>,
    across: [Vec<f32>; 3],
}

/// What decides whether a link may be a jump.
#[derive(Clone, Copy)]
struct Limits {
    phase: f32,
    amplitude: f32,
}

/// One end of the links of a row: logarithm of the amplitude and variance of the phase.
#[derive(Clone, Copy)]
struct End<'a> {
    log_amplitude: &'a [f32],
    variance: &'a [f32],
}

impl<'a> End<'a> {
    #[inline(always)]
    fn new(surface: &'a Surface, start: usize, n: usize) -> Self {
        Self { log_amplitude: &surface.log_amplitude[start..][..n], variance: &surface.variance[start..][..n] }
    }
}

impl Cuts {
    /// Cuts the links that may be jumps and sorts the pixels into classes.
    pub fn make(&mut self, grid: &Grid, surface: &Surface) {
        for plane in [&mut self.links, &mut self.cut, &mut self.class, &mut self.flags] {
            plane.clear();
            plane.resize(grid.len(), 0);
        }
        let limits = Limits { phase: PHASE_JUMP_RAD, amplitude: AMPLITUDE_JUMP };
        with_wide_registers(
            #[inline(always)]
            || {
                self.cut_links(grid, surface, limits);
                self.mark_orphans(grid, surface);
                self.classify(grid, surface);
            },
        );
        self.rim.clear();
        for layer in 0..RIM_LAYERS {
            self.add_rim(grid, layer);
        }
        with_wide_registers(
            #[inline(always)]
            || self.keep_links_of_one_class(grid),
        );
    }

    #[inline(always)]
    fn cut_links(&mut self, grid: &Grid, surface: &Surface, limits: Limits) {
        let Self { links, cut, along, across: [above, here, below], .. } = self;
        let (n, stride) = (grid.width, grid.stride);
        let row = |index: usize| &surface.phase[index * stride..][..stride];
        wrapped_steps(row(0), row(1), above);
        wrapped_steps(row(1), row(2), here);
        for index in 1..=grid.height {
            // Beyond the last row there is nothing, and no link that would ask for it.
            wrapped_steps(row(index + 1), row((index + 2).min(grid.height + 1)), below);
            wrapped_steps(row(index), &row(index)[1..], along);
            along.push(f32::NAN);
            let start = index * stride + 1;
            let (links, cut) = (&mut links[start..][..n], &mut cut[start..][..n]);
            let end = End::new(surface, start, n);
            let steps = [&along[..n], &along[1..][..n], &along[2..][..n]];
            cut_row(steps, [end, End::new(surface, start + 1, n)], limits, RIGHT, links, cut);
            if index < grid.height {
                let steps = [&above[1..][..n], &here[1..][..n], &below[1..][..n]];
                cut_row(steps, [end, End::new(surface, start + stride, n)], limits, DOWN, links, cut);
            }
            // The rim may show the other side of a cyclic axis; links end before it.
            links[n - 1] &= !RIGHT;
            cut[n - 1] &= !RIGHT;
            std::mem::swap(above, here);
            std::mem::swap(here, below);
        }
    }

    /// Orphans first are pixels at the end of a cut link, and those that noise makes useless.
    #[inline(always)]
    fn mark_orphans(&mut self, grid: &Grid, surface: &Surface) {
        let n = grid.width;
        for start in grid.row_starts() {
            let (here, left) = (&self.cut[start..][..n], &self.cut[start - 1..][..n]);
            let (up, variance) = (&self.cut[start - grid.stride..][..n], &surface.variance[start..][..n]);
            let out = &mut self.flags[start..][..n];
            for col in 0..n {
                let cut = here[col] | (left[col] & RIGHT) | (up[col] & DOWN);
                out[col] = u8::from((cut != 0) | (variance[col] > CONDUCTING_VARIANCE));
            }
        }
    }

    /// A pixel whose 3 x 3 surroundings hold an orphan is no core, so that a gap of three edges in a cut border does
    /// not join two objects.
    #[inline(always)]
    fn classify(&mut self, grid: &Grid, surface: &Surface) {
        let (n, stride) = (grid.width, grid.stride);
        // Across first, over all rows with their rim; the plane of cuts has served and is free.
        let count = grid.len() - 2;
        let (left, centre, right) = (&self.flags[..count], &self.flags[1..][..count], &self.flags[2..][..count]);
        let out = &mut self.cut[1..][..count];
        for at in 0..count {
            out[at] = left[at] | centre[at] | right[at];
        }
        for start in grid.row_starts() {
            let (up, here) = (&self.cut[start - stride..][..n], &self.cut[start..][..n]);
            let (down, phase) = (&self.cut[start + stride..][..n], &surface.phase[start..][..n]);
            let class = &mut self.class[start..][..n];
            for col in 0..n {
                let near = if up[col] | here[col] | down[col] == 0 { CORE } else { ORPHAN };
                class[col] = if phase[col].is_nan() { 0 } else { near };
            }
        }
    }

    /// Orphans that uncut links lead to from a core, or from the layers before, become rim.
    fn add_rim(&mut self, grid: &Grid, layer: usize) {
        let begin = self.rim.len();
        let hold = if layer == 0 { CORE } else { RIM };
        with_wide_registers(
            #[inline(always)]
            || self.flag_rim(grid, hold),
        );
        for start in grid.row_starts() {
            for (block, flags) in self.flags[start..start + grid.width].chunks(8).enumerate() {
                self.rim.extend(set_bits(flags).map(|bit| (start + 8 * block + bit / 8) as u32));
            }
        }
        for &pixel in &self.rim[begin..] {
            self.class[pixel as usize] = RIM;
        }
    }

    #[inline(always)]
    fn flag_rim(&mut self, grid: &Grid, hold: u8) {
        let (n, stride) = (grid.width, grid.stride);
        for start in grid.row_starts() {
            let at = |plane: usize| plane..plane + n;
            let links = [&self.links[at(start - stride)], &self.links[at(start - 1)], &self.links[at(start)]];
            let [up_link, left_link, link] = links;
            let (up, left) = (&self.class[at(start - stride)], &self.class[at(start - 1)]);
            let (right, down) = (&self.class[at(start + 1)], &self.class[at(start + stride)]);
            let class = &self.class[at(start)];
            let out = &mut self.flags[start..][..n];
            // A layer conducts as well as a core does, from the second layer on: classes 1 and 2 up to `hold`.
            let holds = |class: u8| (class != 0) & (class <= hold);
            for col in 0..n {
                let reached = ((up_link[col] & DOWN != 0) & holds(up[col]))
                    | ((left_link[col] & RIGHT != 0) & holds(left[col]))
                    | ((link[col] & RIGHT != 0) & holds(right[col]))
                    | ((link[col] & DOWN != 0) & holds(down[col]));
                out[col] = u8::from((class[col] == ORPHAN) & reached);
            }
        }
    }

    /// Cores conduct to cores and orphans to orphans; what leads to a rim pixel becomes a hook.
    #[inline(always)]
    fn keep_links_of_one_class(&mut self, grid: &Grid) {
        let n = grid.width;
        for start in grid.row_starts() {
            let (class, right) = (&self.class[start..][..n], &self.class[start + 1..][..n]);
            let down = &self.class[start + grid.stride..][..n];
            let links = &mut self.links[start..][..n];
            for col in 0..n {
                let link = links[col];
                links[col] = kept(link & RIGHT, class[col], right[col]) | kept(link & DOWN, class[col], down[col]);
            }
        }
    }
}

/// What becomes of a link between pixels of two classes.
#[inline(always)]
fn kept(bit: u8, class: u8, other: u8) -> u8 {
    let same = (class == other) & (class != RIM);
    let rim = ((class == RIM) | (other == RIM)) & (class != ORPHAN) & (other != ORPHAN);
    let same = if same { bit } else { 0 };
    same | if rim { bit << HOOK } else { 0 }
}

/// Sets `bit` in `links` or in `cut` for each link of a row; `steps` are those before, on and after the link.
#[inline(always)]
fn cut_row(steps: [&[f32]; 3], ends: [End<'_>; 2], limits: Limits, bit: u8, links: &mut [u8], cut: &mut [u8]) {
    let n = links.len().min(cut.len());
    let (links, cut) = (&mut links[..n], &mut cut[..n]);
    let [before, step, after] = steps.map(|steps| &steps[..n]);
    let [one, other] = ends.map(|end| &end.log_amplitude[..n]);
    let [variance, other_variance] = ends.map(|end| &end.variance[..n]);
    for col in 0..n {
        let phase = (step[col] - gentler(before[col], after[col])).abs();
        let amplitude = (other[col] - one[col]).abs();
        // Relative amplitude noise equals phase noise, so the same margin serves both.
        let noise = 4.0 * (variance[col] + other_variance[col]).sqrt();
        let limit = if noise > limits.phase { noise } else { limits.phase };
        let jump = (phase > limit) | (amplitude > limits.amplitude + noise);
        let open = !step[col].is_nan();
        links[col] |= if open & !jump { bit } else { 0 };
        cut[col] |= if open & jump { bit } else { 0 };
    }
}

/// The slope that both sides share: the gentler of two of one sign, else zero. A steep floor keeps its slope, while
/// an edge smeared over two pixels does not pass as one, since beyond it the surface is flat.
#[inline(always)]
pub(crate) fn gentler(before: f32, after: f32) -> f32 {
    let least = if before.abs() < after.abs() { before } else { after };
    if before * after > 0.0 { least } else { 0.0 }
}
