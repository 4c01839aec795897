//! Fringes: how fast the phase runs around a place, measured on tiles, and taken off before windows are summed.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::ops::Range;

use crate::phasor::{angle, unit};
use crate::window::Planes;
use std::f32::consts::{PI, TAU};

/// Side of a tile in pixels: one frequency serves it. A surface that bends by 0.02 rad a pixel each pixel is off by 0.16
/// rad a pixel at its edge, which shortens the mean of the largest window by 6 %.
pub(crate) const TILE: usize = 16;
/// Probability that noise without any fringe passes for one.
const FALSE_ALARM: f32 = 1e-4;

const BINS: usize = 32;
const PRECISE: f32 = 0.1;
/// How fast the phase of a tile runs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Fringe {
    /// Radians a column and a row, each in `[-pi, pi]`.
    pub slope: [f32; 2],
    /// Whether it is told from noise, and from the slope of the other sign that differs by a cycle.
    pub resolved: bool,
}

/// The phasors of one tile with what its windows reach beyond it.
#[derive(Debug, Default)]
pub(crate) struct Tile {
    pub planes: Planes,
    pub width: usize,
    /// Columns and rows of the tile itself within the planes.
    pub core: [Range<usize>; 2],
    pub fringe: Fringe,
    turns: Vec<[f32; 2]>,
    table: Vec<[f32; 2]>,
    rows: Vec<[[f32; BINS]; 2]>,
}

impl Tile {
    /// Takes the tile whose first pixel is `first` out of the image, with `margin` pixels around it.
    #[inline(always)]
    pub fn load(&mut self, image: &Planes, [width, height]: [usize; 2], first: [usize; 2], margin: usize) {
        let begin = first.map(|first| first.saturating_sub(margin));
        let end = [(first[0] + TILE + margin).min(width), (first[1] + TILE + margin).min(height)];
        self.width = end[0] - begin[0];
        self.planes.resize(self.width * (end[1] - begin[1]));
        for (tile, image) in self.planes.each().into_iter().zip(image.all()) {
            for (row, values) in tile.chunks_exact_mut(self.width).enumerate() {
                values.copy_from_slice(&image[(begin[1] + row) * width + begin[0]..][..self.width]);
            }
        }
        let core = |axis: usize, size: usize| {
            first[axis] - begin[axis]..(first[axis] + TILE).min(size) - begin[axis]
        };
        self.core = [core(0, width), core(1, height)];
        let steps = [self.slope(1), self.slope(self.width)];
        self.fringe = if steps.iter().all(|step| step.1 < PRECISE) {
            Fringe { slope: steps.map(|step| step.0), resolved: true }
        } else {
            self.strongest()
        };
        self.fringe.resolved &= self.fringe.slope.iter().all(|slope| slope.abs() + 3.0 * PRECISE < PI);
        self.turn_back();
    }

    /// Angle of the mean product of neighbours, and whether it is one: jumps spoil few of the products.
    #[inline(always)]
    fn slope(&self, step: usize) -> (f32, f32) {
        let Planes { re, im, information } = &self.planes;
        let (mut sums, mut lane_rows) = ([[0.0_f32; 8]; 3], 0);
        let _ = &mut lane_rows;
        let length = if step == 1 { self.width - 1 } else { self.width };
        let rows = re.len() / self.width - usize::from(step != 1);
        for row in 0..rows {
            let start = row * self.width;
            let (a, b) = (&re[start..][..length], &im[start..][..length]);
            let (c, d) = (&re[start + step..][..length], &im[start + step..][..length]);
            for at in 0..length {
                let lane = at & 7;
                sums[0][lane] += a[at] * c[at] + b[at] * d[at];
                sums[1][lane] += a[at] * d[at] - b[at] * c[at];
                sums[2][lane] += (a[at] * a[at] + b[at] * b[at]) * (c[at] * c[at] + d[at] * d[at]);
            }
        }
        let _ = information;
        let [along, across, power] = sums.map(|lanes| lanes.iter().sum::<f32>());
        let square = along * along + across * across;
        let turn = angle(along, across);
        let slope = if turn > PI { turn - TAU } else { turn };
        (slope, (0.5 * power / square.max(f32::MIN_POSITIVE)).sqrt())
    }

    /// The strongest of `BINS` slopes in either direction: the peak of the periodogram.
    #[inline(always)]
    fn strongest(&mut self) -> Fringe {
        let Self { planes, width, rows, table, .. } = self;
        if table.is_empty() {
            table.extend((0..BINS).map(|n| unit(n as f32 * TAU / BINS as f32)));
        }
        let height = planes.re.len() / *width;
        rows.clear();
        rows.resize(height, [[0.0; BINS]; 2]);
        let mut power = 0.0;
        for (row, sums) in rows.iter_mut().enumerate() {
            for col in 0..*width {
                let (a, b) = (planes.re[row * *width + col], planes.im[row * *width + col]);
                power += a * a + b * b;
                for k in 0..BINS {
                    let [c, d] = table[k * col % BINS];
                    sums[0][k] += a * c + b * d;
                    sums[1][k] += b * c - a * d;
                }
            }
        }
        let (mut best, mut slope) = (0.0, [0; 2]);
        for l in 0..BINS {
            let mut sums = [[0.0_f32; BINS]; 2];
            for (row, [re, im]) in rows.iter().enumerate() {
                let [c, d] = table[l * row % BINS];
                for k in 0..BINS {
                    sums[0][k] += re[k] * c + im[k] * d;
                    sums[1][k] += im[k] * c - re[k] * d;
                }
            }
            for k in 0..BINS {
                let square = sums[0][k] * sums[0][k] + sums[1][k] * sums[1][k];
                if square > best {
                    (best, slope) = (square, [k, l]);
                }
            }
        }
        let resolved = best > ((BINS * BINS) as f32 / FALSE_ALARM).ln() * power;
        let signed = |bin: usize| if bin > BINS / 2 { bin as f32 - BINS as f32 } else { bin as f32 };
        let slope = slope.map(|bin| if resolved { signed(bin) * TAU / BINS as f32 } else { 0.0 });
        Fringe { slope, resolved }
    }

    /// Turns each phasor back by the fringe, counted from the corner of the planes.
    #[inline(always)]
    fn turn_back(&mut self) {
        let Planes { re, im, .. } = &mut self.planes;
        let [columns, rows] = self.fringe.slope;
        self.turns.clear();
        self.turns.extend((0..self.width).map(|col| unit((columns * col as f32).rem_euclid(TAU).min(TAU))));
        let rows_of = re.chunks_exact_mut(self.width).zip(im.chunks_exact_mut(self.width));
        for (row, (re, im)) in rows_of.enumerate() {
            let [cosine, sine] = unit((rows * row as f32).rem_euclid(TAU).min(TAU));
            for ((re, im), [a, b]) in re.iter_mut().zip(im).zip(&self.turns) {
                let (along, across) = (a * cosine - b * sine, a * sine + b * cosine);
                (*re, *im) = (*re * along + *im * across, *im * along - *re * across);
            }
        }
    }
}
