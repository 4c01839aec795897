//! The surfaces of a range image as flat patches: a quadtree of plane fits.
//!
//! A plane `n·X = 1` shows the range `ρ` along the unit direction `u` with `1/ρ = n·u`: linear in `n`, whatever the
//! angle of incidence. Normals from whole patches stand the noise that differences of neighbours do not.

use range_image::{Flags, RangeFrame};

use crate::numbers::cholesky::Cholesky;
use crate::numbers::vector::{Vec3, cross, dot, scaled, sub};

/// Least cosine of the angle of incidence of a patch: beyond, its area is not known.
const LEAST_COSINE: f64 = 0.05;
/// How much less flat than others the smallest patches may be: an edge where two walls meet has to lie in some patch.
const SMALLEST_TOLERANCE: f64 = 5.0;

/// How patches are made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PatchSize {
    pub patch_px: usize,
    pub cell_px: usize,
    pub flatness_m: f64,
}

/// A piece of surface that sends light on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Facet {
    pub centre: Vec3,
    /// Unit normal, towards the camera.
    pub normal: Vec3,
    pub range_m: f64,
    pub area_m2: f64,
    /// Mean amplitude of its pixels; NaN where none has one.
    pub amplitude: f64,
}

impl Facet {
    /// Light of the source on it, relative to a facing surface at one metre.
    pub fn irradiance(&self) -> f64 {
        -dot(&self.normal, &self.centre) / self.range_m.powi(3)
    }
}

/// A square of pixels, cut off at the frame's rim.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Square {
    pub col: usize,
    pub row: usize,
    pub size: usize,
}

/// Flat patches and the cells that they consist of.
#[derive(Debug, Default)]
pub(crate) struct Patches {
    /// Each patch with the positions of its cells.
    pub patches: Vec<(Facet, std::ops::Range<usize>)>,
    /// Each cell with its pixels.
    pub cells: Vec<(Facet, Square)>,
}

/// The scene as the patches see it.
pub(crate) struct Surfaces<'a> {
    frame: &'a RangeFrame,
    directions: &'a [Vec3],
    solid_angles: &'a [f64],
}

impl<'a> Surfaces<'a> {
    /// Directions and solid angles are row-major, of the frame's size.
    pub fn new(frame: &'a RangeFrame, directions: &'a [Vec3], solid_angles: &'a [f64]) -> Self {
        Self { frame, directions, solid_angles }
    }

    /// Cuts the frame into patches, row by row of the largest squares.
    pub fn patches(&self, size: &PatchSize) -> Patches {
        let mut patches = Patches::default();
        for row in (0..self.frame.height()).step_by(size.patch_px) {
            for col in (0..self.frame.width()).step_by(size.patch_px) {
                self.cut(Square { col, row, size: size.patch_px }, size, &mut patches);
            }
        }
        patches
    }

    /// Takes a square as one patch if it is flat, and its quarters otherwise.
    fn cut(&self, square: Square, size: &PatchSize, patches: &mut Patches) {
        let smallest = square.size <= size.cell_px;
        let tolerance = size.flatness_m * if smallest { SMALLEST_TOLERANCE } else { 1.0 };
        let plane = self.fit(square).filter(|plane| plane.misfit_m < tolerance + 2.0 * plane.sigma_m);
        if let Some(plane) = plane {
            self.take(square, &plane.normal, size.cell_px, patches);
        } else if !smallest {
            let half = square.size / 2;
            for (dx, dy) in [(0, 0), (half, 0), (0, half), (half, half)] {
                self.cut(Square { col: square.col + dx, row: square.row + dy, size: half }, size, patches);
            }
        }
    }

    fn take(&self, square: Square, plane: &Vec3, cell_px: usize, patches: &mut Patches) {
        let Some(facet) = self.facet(square, plane) else { return };
        let first = patches.cells.len();
        for row in (square.row..square.row + square.size).step_by(cell_px) {
            for col in (square.col..square.col + square.size).step_by(cell_px) {
                let cell = Square { col, row, size: cell_px.min(square.size) };
                patches.cells.extend(self.facet(cell, plane).map(|facet| (facet, cell)));
            }
        }
        patches.patches.push((facet, first..patches.cells.len()));
    }

    /// The usable pixels of a square: row-major position and range.
    pub fn pixels(&self, square: Square) -> impl Iterator<Item = (usize, f64)> {
        const UNUSABLE: Flags = Flags::NO_DATA.union(Flags::MIXED_PIXEL);
        let (width, height) = (self.frame.width(), self.frame.height());
        let rows = square.row..(square.row + square.size).min(height);
        let columns = move || square.col..(square.col + square.size).min(width);
        rows.flat_map(move |row| columns().map(move |col| row * width + col)).filter_map(|index| {
            let range = f64::from(self.frame.range.as_slice()[index]);
            let seen = range > 0.0 && range.is_finite() && self.solid_angles[index] > 0.0;
            (seen && !self.frame.flags.as_slice()[index].intersects(UNUSABLE)).then_some((index, range))
        })
    }

    /// The plane through the pixels of a square.
    ///
    /// Its slope is held to that of a surface facing the camera with a standard deviation of 45 degrees: on few or
    /// noisy pixels, ranges alone would make it anything.
    fn fit(&self, square: Square) -> Option<Plane> {
        let mut sums = self.sums(square)?;
        let free = Cholesky::new(&sums.matrix)?.solve(&sums.right);
        let misfit_m = self.misfit(square, &free, sums.count);
        let sigma_m = sums.sigma / sums.with_sigma.max(1.0);
        let mean_range = sums.count / sums.inverse_range;
        let hold = (misfit_m * misfit_m + sigma_m * sigma_m) / (mean_range * mean_range);
        let facing = scaled(&sums.direction, 1.0 / (sums.count * mean_range));
        for (axis, facing) in facing.iter().enumerate() {
            sums.matrix[axis][axis] += hold;
            sums.right[axis] += hold * facing;
        }
        let normal = Cholesky::new(&sums.matrix)?.solve(&sums.right);
        Some(Plane { normal, misfit_m, sigma_m })
    }

    /// Normal equations of the plane, and means; `None` for fewer than four pixels.
    fn sums(&self, square: Square) -> Option<Sums> {
        let mut sums = Sums::default();
        for (index, range) in self.pixels(square) {
            let u = &self.directions[index];
            for (i, row) in sums.matrix.iter_mut().enumerate() {
                sums.right[i] += u[i] / range;
                sums.direction[i] += u[i];
                row.iter_mut().zip(u).for_each(|(entry, other)| *entry += u[i] * other);
            }
            let own = f64::from(self.frame.sigma.as_slice()[index]);
            if own.is_finite() {
                (sums.sigma, sums.with_sigma) = (sums.sigma + own, sums.with_sigma + 1.0);
            }
            sums.inverse_range += 1.0 / range;
            sums.count += 1.0;
        }
        (sums.count >= 4.0).then_some(sums)
    }

    /// Root mean square distance of the ranges from a plane, metre.
    fn misfit(&self, square: Square, plane: &Vec3, count: f64) -> f64 {
        let distance =
            |(index, range): (usize, f64)| (1.0 / range - dot(plane, &self.directions[index])) * range * range;
        let squares: f64 = self.pixels(square).map(|pixel| distance(pixel).powi(2)).sum();
        (squares / (count - 3.0)).sqrt()
    }

    /// The part of a plane that a square of pixels sees.
    fn facet(&self, square: Square, plane: &Vec3) -> Option<Facet> {
        let length = dot(plane, plane).sqrt();
        let normal = scaled(plane, -1.0 / length);
        let (mut direction, mut area_m2, mut count) = ([0.0; 3], 0.0, 0.0);
        let (mut amplitude, mut with_amplitude) = (0.0, 0.0);
        for (index, _) in self.pixels(square) {
            let u = &self.directions[index];
            let (inverse_range, cosine) = (dot(plane, u), -dot(&normal, u));
            if cosine < LEAST_COSINE {
                return None;
            }
            area_m2 += self.solid_angles[index] / (inverse_range * inverse_range * cosine);
            direction = [0, 1, 2].map(|axis| direction[axis] + u[axis]);
            let own = f64::from(self.frame.amplitude.as_slice()[index]);
            if own >= 0.0 && own.is_finite() {
                (amplitude, with_amplitude) = (amplitude + own, with_amplitude + 1.0);
            }
            count += 1.0;
        }
        let mean = scaled(&direction, 1.0 / dot(&direction, &direction).sqrt());
        let range_m = 1.0 / dot(plane, &mean);
        let whole = count > 0.0 && range_m.is_finite() && range_m > 0.0 && area_m2.is_finite();
        let amplitude = amplitude / with_amplitude;
        whole.then(|| Facet { centre: scaled(&mean, range_m), normal, range_m, area_m2, amplitude })
    }
}

/// Sums over the pixels of a square.
#[derive(Default)]
struct Sums {
    matrix: [[f64; 3]; 3],
    right: Vec3,
    direction: Vec3,
    inverse_range: f64,
    count: f64,
    /// Of the standard deviations that are known, metre.
    sigma: f64,
    with_sigma: f64,
}

struct Plane {
    /// `n` of `n·X = 1`, 1/m.
    normal: Vec3,
    /// Root mean square distance of the ranges from it, metre.
    misfit_m: f64,
    /// Mean standard deviation of the ranges, metre; 0 where none is known.
    sigma_m: f64,
}

/// Solid angle of each pixel, from the directions of its neighbours; NaN where they are not known.
pub(crate) fn solid_angles(directions: &[Vec3], width: usize, height: usize) -> Vec<f64> {
    let span = |index: usize, position: usize, length: usize, stride: usize| {
        let before = if position > 0 { index - stride } else { index };
        let after = if position + 1 < length { index + stride } else { index };
        let steps = f64::from(u8::from(position > 0) + u8::from(position + 1 < length));
        scaled(&sub(&directions[after], &directions[before]), 1.0 / steps)
    };
    let pixel = |index: usize| {
        let across = span(index, index % width, width, 1);
        let down = span(index, index / width, height, width);
        let normal = cross(&across, &down);
        dot(&normal, &normal).sqrt()
    };
    (0..width * height).map(pixel).collect()
}
