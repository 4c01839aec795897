//! Fringes: how fast the phase runs around a place. It is measured on tiles and taken off before windows are summed.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::{PI, TAU};
use std::ops::Range;

use crate::filter::phasor::{angle, unit};
use crate::filter::window::{LANES, Planes, lanes};

/// Side of a tile in pixels: one slope serves it. A surface whose slope grows by 0.02 rad a pixel from pixel to pixel is
/// off by 0.16 rad a pixel at the tile's edge, which takes a tenth of the mean of the largest window; twice the side
/// halves the bend that is followed, half of it doubles the noise of the slope.
pub(crate) const TILE: usize = 16;
/// Slopes of the periodogram in each direction: 0.2 rad a pixel apart, so that none is off by more than 0.1.
const SLOPES: usize = 32;
/// Deviation in radians a pixel up to which the mean step between neighbours is good enough. An error of 0.12 takes a
/// fourteenth of the mean of a window of eleven pixels a side, 0.24 a quarter.
const PRECISE: f32 = 0.12;
/// Probability that the periodogram of noise has a peak that passes for a fringe. Fringes are so seen in noise of up to
/// 1.93 rad; at a hundredth of it, in up to 1.87.
const FALSE_ALARM: f32 = 1e-4;
/// Deviations of its slope by which a fringe must stay below half a cycle a pixel.
const DEVIATIONS: f32 = 3.0;

/// The phasors of one tile with what its windows reach beyond it, turned back by the fringe.
#[derive(Debug, Default)]
pub(crate) struct Tile {
    pub planes: Planes,
    /// Elements of a row of the planes: whole groups of eight, of which at least the last is masked.
    pub width: usize,
    /// Columns and rows of the tile itself within the planes.
    pub core: [Range<usize>; 2],
    /// How fast the phase ran, radians a column and a row in `[-pi, pi]`, before that was taken off.
    pub slope: [f32; 2],
    /// Whether the slope is told from noise, and from the one that differs by a cycle.
    pub resolved: bool,
    /// Cosines and sines of the fringe along a row.
    turns: [Vec<f32>; 2],
    periodogram: Periodogram,
}

impl Tile {
    /// Takes the tile whose first pixel is `first` out of the image, with `margin` pixels around it.
    #[inline(always)]
    pub fn load(&mut self, image: &Planes, [width, height]: [usize; 2], first: [usize; 2], margin: usize) {
        let begin = first.map(|first| first.saturating_sub(margin));
        let end = [(first[0] + TILE + margin).min(width), (first[1] + TILE + margin).min(height)];
        let used = end[0] - begin[0];
        self.width = (used / LANES + 1) * LANES;
        self.planes.resize(self.width * (end[1] - begin[1]));
        for (tile, image) in self.planes.each().into_iter().zip(image.all()) {
            for (row, values) in tile.chunks_exact_mut(self.width).enumerate() {
                let (values, rest) = values.split_at_mut(used);
                values.copy_from_slice(&image[(begin[1] + row) * width + begin[0]..][..used]);
                rest.fill(0.0);
            }
        }
        let core = |axis: usize, size: usize| first[axis] - begin[axis]..(first[axis] + TILE).min(size) - begin[axis];
        self.core = [core(0, width), core(1, height)];
        // A single pixel has no neighbours, and windows of one pixel need no slope.
        (self.slope, self.resolved) = if margin == 0 { ([0.0; 2], true) } else { self.measure() };
        self.turn_back();
    }

    /// The mean step between neighbours serves where it is precise: jumps spoil few of the steps. In stronger noise the
    /// strongest slope of the whole tile is still seen. Says whether the slope is told; if noise hides it, the mean step
    /// is the best guess, and near half a cycle there is none.
    #[inline(always)]
    fn measure(&mut self) -> ([f32; 2], bool) {
        let steps = [self.mean_step(1), self.mean_step(self.width)];
        let (mean, mut sigma) = (steps.map(|step| step.0), steps.map(|step| step.1));
        let mut slope = mean;
        if sigma.iter().any(|sigma| *sigma >= PRECISE) {
            let Some(strongest) = self.periodogram.strongest(&self.planes, self.width) else {
                return (mean, false);
            };
            // Evenly spread between its neighbours.
            (slope, sigma) = (strongest, [TAU / SLOPES as f32 / 12.0_f32.sqrt(); 2]);
        }
        let one_side = slope.iter().zip(sigma).all(|(slope, sigma)| slope.abs() + DEVIATIONS * sigma < PI);
        if one_side { (slope, true) } else { ([0.0; 2], false) }
    }

    /// Angle of the mean product of pixels that are `step` apart, and its standard deviation.
    #[inline(always)]
    fn mean_step(&self, step: usize) -> (f32, f32) {
        let Planes { re, im, .. } = &self.planes;
        let mut sums = [[0.0_f32; LANES]; 3];
        // Rows end with a masked pixel, so that the first of the next one adds nothing.
        for at in (0..re.len() - self.width).step_by(LANES) {
            let ([a, b], [c, d]) = ([lanes(re, at), lanes(im, at)], [lanes(re, at + step), lanes(im, at + step)]);
            for lane in 0..LANES {
                let [a, b, c, d] = [a[lane], b[lane], c[lane], d[lane]];
                sums[0][lane] += a * c + b * d;
                sums[1][lane] += a * d - b * c;
                sums[2][lane] += (a * a + b * b) * (c * c + d * d);
            }
        }
        let [along, across, power] = sums.map(|lanes| lanes.iter().sum::<f32>());
        let square = along * along + across * across;
        let turn = angle(along, across);
        // In noise alone the square scatters around the power: half of it lies across.
        let sigma = (0.5 * power / square.max(f32::MIN_POSITIVE)).sqrt();
        (if turn > PI { turn - TAU } else { turn }, sigma)
    }

    /// Turns each phasor back by the fringe, counted from the corner of the planes.
    #[inline(always)]
    fn turn_back(&mut self) {
        let [columns, rows] = self.slope;
        if self.slope.iter().all(|slope| slope.abs() <= 0.0) {
            return;
        }
        let turn = |slope: f32, at: usize| unit((slope * at as f32).rem_euclid(TAU).min(TAU));
        for turns in &mut self.turns {
            turns.clear();
        }
        for col in 0..self.width {
            let [cosine, sine] = turn(columns, col);
            self.turns[0].push(cosine);
            self.turns[1].push(sine);
        }
        let Planes { re, im, .. } = &mut self.planes;
        let lines = re.chunks_exact_mut(self.width).zip(im.chunks_exact_mut(self.width));
        for (row, (re, im)) in lines.enumerate() {
            let [cosine, sine] = turn(rows, row);
            for at in (0..re.len()).step_by(LANES) {
                let (a, b) = (lanes(&self.turns[0], at), lanes(&self.turns[1], at));
                let (mut x, mut y) = (lanes(re, at), lanes(im, at));
                for lane in 0..LANES {
                    let along = a[lane] * cosine - b[lane] * sine;
                    let across = a[lane] * sine + b[lane] * cosine;
                    (x[lane], y[lane]) = (x[lane] * along + y[lane] * across, y[lane] * along - x[lane] * across);
                }
                re[at..at + LANES].copy_from_slice(&x);
                im[at..at + LANES].copy_from_slice(&y);
            }
        }
    }
}

/// Sums of the phasors of a tile, turned back by each of a grid of slopes `[Rife1974]`.
#[derive(Debug, Default)]
struct Periodogram {
    /// Cosines and sines of all slopes, for each pixel of a row or column.
    turns: Vec<[[f32; SLOPES]; 2]>,
    /// Sums of each row.
    rows: Vec<[[f32; SLOPES]; 2]>,
}

impl Periodogram {
    /// The slope of the largest sum; `None` where noise makes as large a one.
    #[inline(always)]
    fn strongest(&mut self, planes: &Planes, width: usize) -> Option<[f32; 2]> {
        if self.turns.is_empty() {
            let unit = |n: usize| unit((n % SLOPES) as f32 * TAU / SLOPES as f32);
            let turns = |at: usize| [0, 1].map(|part| std::array::from_fn(|slope| unit(slope * at)[part]));
            self.turns.extend((0..SLOPES).map(turns));
        }
        self.rows.clear();
        for (re, im) in planes.re.chunks_exact(width).zip(planes.im.chunks_exact(width)) {
            let mut sums = [[0.0; SLOPES]; 2];
            for (at, (re, im)) in re.iter().zip(im).enumerate() {
                add_turned(&mut sums, &[[*re; SLOPES], [*im; SLOPES]], &self.turns[at % SLOPES]);
            }
            self.rows.push(sums);
        }
        let (mut best, mut slope) = (0.0, [0; 2]);
        for down in 0..SLOPES {
            let mut sums = [[0.0; SLOPES]; 2];
            for (at, row) in self.rows.iter().enumerate() {
                let [cosine, sine] = self.turns[at % SLOPES];
                add_turned(&mut sums, row, &[[cosine[down]; SLOPES], [sine[down]; SLOPES]]);
            }
            for (across, (re, im)) in sums[0].iter().zip(&sums[1]).enumerate() {
                let square = re * re + im * im;
                if square > best {
                    (best, slope) = (square, [across, down]);
                }
            }
        }
        let power: f32 = planes.re.iter().zip(&planes.im).map(|(re, im)| re * re + im * im).sum();
        // In noise alone each square is exponential with the mean `power`.
        let told = best > ((SLOPES * SLOPES) as f32 / FALSE_ALARM).ln() * power;
        let signed = |n: usize| if n > SLOPES / 2 { n as f32 - SLOPES as f32 } else { n as f32 };
        told.then(|| slope.map(|n| signed(n) * TAU / SLOPES as f32))
    }
}

/// Adds phasors, turned back by as many angles.
#[inline(always)]
fn add_turned([re, im]: &mut [[f32; SLOPES]; 2], [a, b]: &[[f32; SLOPES]; 2], [cosine, sine]: &[[f32; SLOPES]; 2]) {
    for n in 0..SLOPES {
        re[n] += a[n] * cosine[n] + b[n] * sine[n];
        im[n] += b[n] * cosine[n] - a[n] * sine[n];
    }
}
