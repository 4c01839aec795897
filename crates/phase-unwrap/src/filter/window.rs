//! Sums over square windows of growing size, and the choice of the largest one that hangs together.
//!
//! Rows are worked on in groups of eight pixels, which the compiler keeps in wide registers.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]

use std::f32::consts::{PI, TAU};

use crate::PrefilterOptions;
use crate::filter::fringes::Tile;
use crate::filter::noise::weight;
use crate::filter::phasor::angle;

/// Pixels that go side by side through the registers.
pub(crate) const LANES: usize = 8;

/// Weighted phasors and information of each pixel, row by row; zero where masked.
#[derive(Debug, Default)]
pub(crate) struct Planes {
    pub re: Vec<f32>,
    pub im: Vec<f32>,
    pub information: Vec<f32>,
}

impl Planes {
    pub fn resize(&mut self, pixels: usize) {
        for plane in [&mut self.re, &mut self.im, &mut self.information] {
            plane.resize(pixels, 0.0);
        }
    }
}

/// Sum of phasors and information of the chosen windows of eight pixels.
#[derive(Debug, Clone, Copy, Default)]
struct Group {
    re: [f32; LANES],
    im: [f32; LANES],
    information: [f32; LANES],
    /// Half width of the window.
    radius: [f32; LANES],
    /// Variance of the mean's length over that of its angle, as far as noise goes.
    scatter: [f32; LANES],
    /// Information from which no larger window is needed; 0 where the search has ended.
    wanted: [f32; LANES],
}

/// Limits of the tests, in the form in which they are used.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Limits {
    quiet_sigma: f32,
    target_sigma: f32,
    quiet_information: f32,
    target_information: f32,
    coherence: f32,
    deviations: f32,
    pub largest_radius: usize,
}

impl Limits {
    pub fn new(options: &PrefilterOptions) -> Self {
        let (quiet_sigma, target_sigma) = (options.quiet_sigma_rad, options.target_sigma_rad);
        Self {
            quiet_sigma,
            target_sigma,
            quiet_information: weight(quiet_sigma).information,
            target_information: target_sigma.powi(-2),
            coherence: options.least_coherence,
            deviations: options.deviations,
            largest_radius: options.largest_radius_px.into(),
        }
    }

    /// On a fringe: what is left of half a cycle beside its steps is smaller, and so is the noise that they bear.
    pub fn beside(self, slope: [f32; 2]) -> Self {
        let quiet = self.quiet_sigma * (1.0 - slope[0].abs().max(slope[1].abs()) / PI);
        let target = self.target_sigma.min(quiet);
        Self { quiet_information: weight(quiet).information, target_information: target.powi(-2), ..self }
    }
}

/// A row of the result.
pub(crate) struct RowOut<'a> {
    pub phase: &'a mut [f32],
    pub sigma: &'a mut [f32],
    pub radius: &'a mut [u8],
    /// Phase of the fringe at the first pixel, and what it gains from pixel to pixel.
    pub fringe: [f32; 2],
}

/// Buffers of one row.
#[derive(Debug, Default)]
pub(crate) struct Windows {
    /// Sums over the rows of the window, with a rim of zeros on either side.
    columns: Planes,
    groups: Vec<Group>,
}

impl Windows {
    /// Searches the windows of one row of a tile and writes what they give; `measured` is the phase of the row.
    #[inline(always)]
    pub fn filter_row(&mut self, tile: &Tile, row: usize, measured: &[f32], limits: &Limits, out: &mut RowOut<'_>) {
        let height = tile.planes.re.len() / tile.width;
        let rim = limits.largest_radius;
        self.start(tile, row, limits);
        for radius in 1..=rim {
            if !self.groups.iter().any(Group::is_open) {
                break;
            }
            for other in [row.wrapping_sub(radius), row + radius] {
                if other < height {
                    let row = other * tile.width..(other + 1) * tile.width;
                    add_row(&mut self.columns.re, rim, &tile.planes.re[row.clone()]);
                    add_row(&mut self.columns.im, rim, &tile.planes.im[row.clone()]);
                    add_row(&mut self.columns.information, rim, &tile.planes.information[row]);
                }
            }
            let first = rim + tile.core[0].start - radius;
            for (at, group) in self.groups.iter_mut().enumerate() {
                if group.is_open() {
                    let (Planes { re, im, information }, first) = (&self.columns, first + at * LANES);
                    let re = window_sum(re, first, radius);
                    let im = window_sum(im, first, radius);
                    let information = window_sum(information, first, radius);
                    group.choose([&re, &im, &information], radius, limits);
                }
            }
        }
        for (at, group) in self.groups.iter().enumerate() {
            group.write(measured, at * LANES, out);
        }
    }

    #[inline(always)]
    fn start(&mut self, tile: &Tile, row: usize, limits: &Limits) {
        let Tile { planes, width, core, .. } = tile;
        let groups = core[0].len().div_ceil(LANES);
        let rim = limits.largest_radius;
        self.groups.resize(groups, Group::default());
        for (columns, source) in self.columns.each().into_iter().zip(planes.all()) {
            columns.clear();
            columns.resize(width + groups * LANES + 2 * rim, 0.0);
            columns[rim..rim + width].copy_from_slice(&source[row * width..][..*width]);
        }
        for (at, group) in self.groups.iter_mut().enumerate() {
            let [re, im, information] = self.columns.all().map(|plane| lanes(plane, rim + core[0].start + at * LANES));
            *group = Group { re, im, information, ..Group::default() };
            group.start(limits);
        }
    }
}

impl Group {
    #[inline(always)]
    fn is_open(&self) -> bool {
        self.wanted.iter().fold(0.0, |sum, wanted| sum + wanted) > 0.0
    }

    #[inline(always)]
    fn start(&mut self, limits: &Limits) {
        for lane in 0..LANES {
            let own = self.information[lane];
            // With q = rho^2 the information is 2 q / (1 - q^2), and the variances relate as (1 - q) / (1 + q).
            let q = own / (1.0 + (1.0 + own * own).sqrt());
            self.scatter[lane] = (1.0 - q) / (1.0 + q);
            let noisy = own > 0.0 && own < limits.quiet_information.min(limits.target_information);
            self.wanted[lane] = if noisy { limits.target_information } else { 0.0 };
        }
    }

    /// Takes the larger windows where they hang together with the smaller ones.
    #[inline(always)]
    fn choose(&mut self, [re, im, information]: [&[f32; LANES]; 3], radius: usize, limits: &Limits) {
        let squared = limits.deviations * limits.deviations;
        for lane in 0..LANES {
            let (a, b, i) = (re[lane], im[lane], information[lane]);
            let (old_a, old_b, old_i) = (self.re[lane], self.im[lane], self.information[lane]);
            let square = a * a + b * b;
            let shortest = limits.coherence * i - limits.deviations * (self.scatter[lane] * i).sqrt();
            let shortest = shortest.max(0.0);
            // The smaller window is part of the larger: the variance of the turn is the difference of the variances.
            let variance = 1.0 / old_i.max(f32::MIN_POSITIVE) - 1.0 / i.max(f32::MIN_POSITIVE);
            let least_cosine = 1.0 - 0.5 * squared * variance;
            let length = (square * (old_a * old_a + old_b * old_b)).sqrt();
            let together = square >= shortest * shortest;
            let same = a * old_a + b * old_b >= least_cosine * length;
            let wanted = self.wanted[lane];
            let accepted = (wanted > 0.0) & together & same;
            self.re[lane] = if accepted { a } else { old_a };
            self.im[lane] = if accepted { b } else { old_b };
            self.information[lane] = if accepted { i } else { old_i };
            self.radius[lane] = if accepted { radius as f32 } else { self.radius[lane] };
            self.wanted[lane] = if accepted && i < wanted { wanted } else { 0.0 };
        }
    }

    #[inline(always)]
    fn write(&self, measured: &[f32], at: usize, out: &mut RowOut<'_>) {
        let (mut phase, mut sigma, mut radius) = ([0.0; LANES], [0.0; LANES], [0; LANES]);
        let used = LANES.min(measured.len() - at);
        phase[..used].copy_from_slice(&measured[at..at + used]);
        for lane in 0..LANES {
            let [start, gain] = out.fringe;
            let turned = angle(self.re[lane], self.im[lane]) + start + gain * (at + lane) as f32;
            // Rounding may give a whole cycle for what lies just below none.
            let mean = (turned - TAU * (turned / TAU).floor()).clamp(0.0, TAU);
            let filtered = if self.radius[lane] > 0.0 { mean } else { phase[lane] };
            let masked = self.information[lane] <= 0.0;
            phase[lane] = if masked { f32::NAN } else { filtered };
            sigma[lane] = if masked { f32::NAN } else { 1.0 / self.information[lane].sqrt() };
            radius[lane] = self.radius[lane] as u8;
        }
        out.phase[at..at + used].copy_from_slice(&phase[..used]);
        out.sigma[at..at + used].copy_from_slice(&sigma[..used]);
        out.radius[at..at + used].copy_from_slice(&radius[..used]);
    }
}

/// Sum of `2 radius + 1` columns for eight pixels, the first of them starting at `first`.
#[inline(always)]
fn window_sum(columns: &[f32], first: usize, radius: usize) -> [f32; LANES] {
    let mut sum = [0.0; LANES];
    let columns = &columns[first..first + 2 * radius + LANES];
    for values in columns.windows(LANES) {
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += value;
        }
    }
    sum
}

/// Adds a row, of whole groups, to the columns from `first` on.
#[inline(always)]
fn add_row(columns: &mut [f32], first: usize, row: &[f32]) {
    let sums = columns[first..first + row.len()].chunks_exact_mut(LANES);
    for (sums, values) in sums.zip(row.chunks_exact(LANES)) {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value;
        }
    }
}

#[inline(always)]
pub(crate) fn lanes(plane: &[f32], first: usize) -> [f32; LANES] {
    plane[first..].first_chunk().copied().unwrap_or_default()
}

impl Planes {
    pub fn all(&self) -> [&[f32]; 3] {
        [&self.re, &self.im, &self.information]
    }

    pub fn each(&mut self) -> [&mut Vec<f32>; 3] {
        [&mut self.re, &mut self.im, &mut self.information]
    }
}
