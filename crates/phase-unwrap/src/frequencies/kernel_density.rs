//! The choice among a pixel's hypotheses by what the neighbours' hypotheses say.
// Only what is inlined is compiled for wide registers; loops over lanes read as their formulas, without branches.
#![allow(clippy::inline_always, clippy::needless_range_loop, clippy::needless_bitwise_bool)]

use crate::frequencies::lanes::{LANES, Lanes, select};
use crate::frequencies::lattice::Found;
use crate::{Error, Result};

/// Hypotheses that are kept of each pixel.
pub(crate) const RANKS: usize = 3;
/// Largest half width of the neighbourhood.
const MAXIMUM_RADIUS: u8 = 3;
/// Standard deviations of the range at which the kernel ends; the difference of two ranges has 1.4.
const KERNEL_SIGMAS: f32 = 3.5;
/// A kernel wider than this many cycles of the highest frequency would reach the next hypothesis.
const WIDEST_CYCLES: f32 = 0.45;
/// Half width of the kernel without noise, cycles of the highest frequency: how far ranges of neighbours on one surface lie
/// apart, to which their noise is added. A choice on which the figures of `tests/kernel_density.rs` rest; where it is
/// smaller, neighbours on slanted surfaces no longer support each other, where it is larger, so do both sides of a step.
const TOLERANCE_CYCLES: f32 = 0.08;
/// Density that a hypothesis has without any neighbour, as a share of full agreement. A choice as above; the smaller,
/// the more neighbours decide against the pixel's own misfit.
const BACKGROUND: f32 = 0.02;
/// What neighbours that support none of a pixel's hypotheses add to the background. A choice as above; the larger,
/// the less neighbours decide in a rough scene, and at zero a wire of one pixel is left to the wall behind it.
const SCATTERED: f32 = 0.2;

/// How neighbours take part in the choice of the wrap counts `[JaremoLawin2016]`.
///
/// Each hypothesis of a pixel gets the density of its neighbours' hypotheses at its range. Neighbours weigh as their
/// own hypotheses are probable and near, not by their position alone: a wire before a wall is not pulled to the wall,
/// because the wall's ranges support none of the wire's hypotheses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KernelDensityOptions {
    /// Half width of the square neighbourhood in pixels, 1 to 3. One serves thin objects best; two is better on noisy
    /// walls and takes three times as long. Default: 1.
    pub radius: u8,
}

impl Default for KernelDensityOptions {
    fn default() -> Self {
        Self { radius: 1 }
    }
}

impl KernelDensityOptions {
    pub(crate) fn validate(self) -> Result<()> {
        if (1..=MAXIMUM_RADIUS).contains(&self.radius) {
            return Ok(());
        }
        Err(Error::OutOfDomain { name: "radius", value: self.radius.into(), expected: "1 to 3 pixels" })
    }
}

/// Hypotheses of the rows around one, kept while the rows of a frame are taken one after the other. A row holds one line with
/// margins for each of: ranges, probabilities, the kernel's inverse squared width, the fit. What lies outside the image has
/// probability 0.
#[derive(Debug, Default, Clone)]
pub struct RowWindow {
    lines: Vec<f32>,
    layout: Layout,
    neighbours: Vec<Neighbour>,
    /// Which of the rows kept was taken first; the next one takes its place.
    oldest: usize,
}

/// Where things lie in a row of hypotheses.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
pub(crate) struct Layout {
    width: usize,
    /// Columns of a line with its margins.
    padded: usize,
    radius: usize,
    /// Half width of the kernel without noise, metres, and the largest.
    tolerance_m: f32,
    widest_m: f32,
}

#[derive(Debug, Clone, Copy)]
struct Neighbour {
    /// Shifts from the corner of the neighbourhood.
    rows: usize,
    cols: usize,
    /// Share of the neighbourhood's weight.
    weight: f32,
}

/// What became of a block of pixels.
pub(crate) struct Chosen {
    pub(crate) range_m: Lanes,
    pub(crate) confidence: Lanes,
}

const LINES: usize = 2 * RANKS + 2;
const WIDTH_LINE: usize = 2 * RANKS;
const FIT_LINE: usize = 2 * RANKS + 1;

impl RowWindow {
    /// Takes the width of a frame; `interval_m` is that of the highest frequency. Without a kernel, each row is for itself.
    pub(crate) fn resize(&mut self, width: usize, interval_m: f32, options: Option<KernelDensityOptions>) {
        let radius = options.map_or(0, |options| usize::from(options.radius));
        let padded = width.div_ceil(LANES) * LANES + 2 * radius;
        let (tolerance_m, widest_m) = (TOLERANCE_CYCLES * interval_m, WIDEST_CYCLES * interval_m);
        let layout = Layout { width, padded, radius, tolerance_m, widest_m };
        if self.layout != layout {
            self.layout = layout;
            self.lines.clear();
            self.lines.resize(layout.row_length() * (2 * radius + 1), 0.0);
            self.oldest = 0;
            self.set_neighbours();
        }
    }

    /// Columns of the frame.
    pub(crate) fn width(&self) -> usize {
        self.layout.width
    }

    /// The place of the next row, which is that of the oldest one.
    pub(crate) fn next_mut(&mut self) -> (Layout, &mut [f32]) {
        let (length, place) = (self.layout.row_length(), self.oldest);
        self.oldest = (place + 1) % (2 * self.layout.radius + 1);
        (self.layout, &mut self.lines[place * length..][..length])
    }

    /// One of the rows kept, from the oldest.
    #[inline(always)]
    fn row(&self, index: usize) -> &[f32] {
        let (length, count) = (self.layout.row_length(), 2 * self.layout.radius + 1);
        let place = self.oldest + index;
        let place = if place < count { place } else { place - count };
        &self.lines[place * length..][..length]
    }

    fn set_neighbours(&mut self) {
        self.neighbours.clear();
        let radius = self.layout.radius;
        let spread = 0.6 * radius as f32 + 0.3;
        let span = 2 * radius + 1;
        for (rows, cols) in (0..span).flat_map(|rows| (0..span).map(move |cols| (rows, cols))) {
            let square = rows.abs_diff(radius).pow(2) + cols.abs_diff(radius).pow(2);
            if square > 0 {
                let weight = (-(square as f32) / (2.0 * spread * spread)).exp();
                self.neighbours.push(Neighbour { rows, cols, weight });
            }
        }
        let total: f32 = self.neighbours.iter().map(|neighbour| neighbour.weight).sum();
        for neighbour in &mut self.neighbours {
            neighbour.weight /= total;
        }
    }

    /// Chooses among the hypotheses of the pixels from column `col` of the row in the middle.
    #[inline(always)]
    pub(crate) fn choose(&self, col: usize) -> Chosen {
        let own = self.row(self.layout.radius);
        let at = self.layout.radius + col;
        let range_m: [Lanes; RANKS] = std::array::from_fn(|rank| self.layout.line(own, rank, at));
        let mut weight: [Lanes; RANKS] = std::array::from_fn(|rank| self.layout.line(own, RANKS + rank, at));
        if is_alone(&weight) {
            return Chosen { range_m: range_m[0], confidence: self.layout.line(own, FIT_LINE, at) };
        }
        if !self.neighbours.is_empty() && !Self::settled(&weight) {
            let density = self.density(col, &range_m, &self.layout.line(own, WIDTH_LINE, at));
            let background = Self::background_of(&density);
            for rank in 0..RANKS {
                for lane in 0..LANES {
                    let support = background[lane] + density[rank][lane];
                    // Neighbours see independent noise, so that agreement is worth more than one density tells: its
                    // cube is calibrated where half of a neighbourhood and more lies on the pixel's surface.
                    weight[rank][lane] *= support * support * support;
                }
            }
        }
        pick(&range_m, &weight, &self.layout.line(own, FIT_LINE, at))
    }

    /// Whether no density can change anything, to a thousandth, in any pixel.
    #[inline(always)]
    fn settled(probability: &[Lanes; RANKS]) -> bool {
        let ratio = BACKGROUND / (1.0 + BACKGROUND);
        let limit = 1e-3 * ratio * ratio * ratio;
        let mut open = false;
        for lane in 0..LANES {
            let mut others = 0.0;
            for probability in &probability[1..] {
                others += probability[lane];
            }
            open |= others > limit * probability[0][lane];
        }
        !open
    }

    #[inline(always)]
    fn background_of(density: &[Lanes; RANKS]) -> Lanes {
        let mut background = [0.0; LANES];
        for lane in 0..LANES {
            let mut explained = 0.0;
            for density in density {
                explained += density[lane];
            }
            background[lane] = BACKGROUND + SCATTERED * (1.0 - explained).max(0.0);
        }
        background
    }

    /// Density of the neighbours' hypotheses at the range of each hypothesis, 1 where all neighbours agree.
    #[inline(always)]
    fn density(&self, col: usize, range_m: &[Lanes; RANKS], inverse: &Lanes) -> [Lanes; RANKS] {
        let mut density = [[0.0; LANES]; RANKS];
        for neighbour in &self.neighbours {
            let other = self.row(neighbour.rows);
            for rank in 0..RANKS {
                let ranges = self.layout.line(other, rank, col + neighbour.cols);
                let probabilities = self.layout.line(other, RANKS + rank, col + neighbour.cols);
                // Hypotheses innermost: the other way round, the compiler puts them side by side, which scatters each sum.
                for lane in 0..LANES {
                    let share = neighbour.weight * probabilities[lane];
                    for own in 0..RANKS {
                        let step = range_m[own][lane] - ranges[lane];
                        let inside = 1.0 - step * step * inverse[lane];
                        let inside = if inside > 0.0 { inside } else { 0.0 };
                        density[own][lane] += share * inside * inside;
                    }
                }
            }
        }
        density
    }
}

impl Layout {
    /// Values of a row.
    pub(crate) fn row_length(&self) -> usize {
        LINES * self.padded
    }

    #[inline(always)]
    fn line(&self, row: &[f32], line: usize, at: usize) -> Lanes {
        row[line * self.padded + at..].first_chunk().copied().unwrap_or([0.0; LANES])
    }

    /// Keeps what the search found for the pixels from column `col`.
    #[inline(always)]
    pub(crate) fn store(&self, row: &mut [f32], col: usize, found: &Found<RANKS>) {
        let mut inverse = [0.0; LANES];
        for lane in 0..LANES {
            let noise_m = KERNEL_SIGMAS * found.sigma_m[lane];
            let square = noise_m * noise_m + self.tolerance_m * self.tolerance_m;
            inverse[lane] = 1.0 / square.min(self.widest_m * self.widest_m);
        }
        let mut put = |line: usize, lanes: &Lanes| {
            row[line * self.padded + self.radius + col..][..LANES].copy_from_slice(lanes);
        };
        // Ranges without probability are not looked at.
        for rank in 0..if found.alone { 1 } else { RANKS } {
            put(rank, &found.range_m[rank]);
        }
        for rank in 0..RANKS {
            put(RANKS + rank, &found.probability[rank]);
        }
        put(WIDTH_LINE, &inverse);
        put(FIT_LINE, &found.acceptable);
    }
}

/// Whether each pixel has one hypothesis and no other.
#[inline(always)]
fn is_alone<const K: usize>(probability: &[Lanes; K]) -> bool {
    let mut off = 0;
    for (rank, probability) in probability.iter().enumerate() {
        let expected = if rank == 0 { 1.0_f32 } else { 0.0 };
        for probability in probability {
            off |= probability.to_bits() ^ expected.to_bits();
        }
    }
    off == 0
}

/// The hypothesis with the greatest weight; its confidence is `2p - 1` with its share p of all weights.
#[inline(always)]
pub(crate) fn pick<const K: usize>(range_m: &[Lanes; K], weight: &[Lanes; K], acceptable: &Lanes) -> Chosen {
    let mut chosen = Chosen { range_m: [f32::NAN; LANES], confidence: [0.0; LANES] };
    let (mut best, mut total) = ([0.0; LANES], [0.0; LANES]);
    for (weight, range_m) in weight.iter().zip(range_m) {
        for lane in 0..LANES {
            chosen.range_m[lane] = select(weight[lane] > best[lane], range_m[lane], chosen.range_m[lane]);
            best[lane] = select(weight[lane] > best[lane], weight[lane], best[lane]);
            total[lane] += weight[lane];
        }
    }
    for lane in 0..LANES {
        let share = best[lane] / total[lane].max(f32::MIN_POSITIVE);
        chosen.confidence[lane] = (2.0 * share - 1.0).max(0.0) * acceptable[lane];
    }
    chosen
}
