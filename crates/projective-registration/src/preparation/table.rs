//! A table over x/z and y/z that tells the pixel of a camera whose rays follow no formula.

use crate::error::{Error, Result};

/// Newton steps within one quadrangle of four rays: its mapping is almost linear.
const STEPS: usize = 4;
/// How far outside its quadrangle an entry is still filled, in entries: bilinear reading needs neighbours at the rim.
const MARGIN: f64 = 2.0;

/// Pixels over a regular grid in u = x/depth, v = y/depth.
#[derive(Debug)]
pub(crate) struct Table {
    pub(super) origin: [f64; 2],
    /// Entries per unit of u and v.
    pub(super) density: [f64; 2],
    pub(super) cols: usize,
    pub(super) rows: usize,
    /// Pixel (col, row) of each entry; NaN where no ray leads.
    pub(super) pixels: Vec<[f32; 2]>,
    /// Pixels from entry to entry.
    spacing: f64,
}

impl Table {
    /// `rays`: (u, v) of each pixel, row by row.
    pub(crate) fn new(width: usize, height: usize, rays: &[[f64; 2]]) -> Result<Self> {
        check_spread(width, height, rays)?;
        Ok(Self::of_every(1.0, width, height, rays))
    }

    /// With an entry for every so many pixels along each side, of rays that neither coincide nor cross.
    pub(super) fn of_every(spacing: f64, width: usize, height: usize, rays: &[[f64; 2]]) -> Self {
        let bound = |i: usize, best: fn(f64, f64) -> f64| rays.iter().map(|r| r[i]).fold(f64::NAN, best);
        let low = [bound(0, f64::min), bound(1, f64::min)];
        let high = [bound(0, f64::max), bound(1, f64::max)];
        // A rim of two for reading at the border.
        let density = [0, 1].map(|i| [width, height][i] as f64 / (spacing * (high[i] - low[i])));
        let origin = [0, 1].map(|i| low[i] - 2.0 / density[i]);
        let [cols, rows] = [width, height].map(|size| (size as f64 / spacing).ceil() as usize + 5);
        let mut table = Self { origin, density, cols, rows, pixels: vec![[f32::NAN; 2]; cols * rows], spacing };
        let mut distances = vec![f64::INFINITY; cols * rows];
        for row in 0..height - 1 {
            for col in 0..width - 1 {
                let k = row * width + col;
                let corners = [rays[k], rays[k + 1], rays[k + width], rays[k + width + 1]];
                table.fill(corners, [col as f64, row as f64], &mut distances);
            }
        }
        table
    }

    /// Fills the entries in and near one quadrangle of rays whose first pixel is `first`. Of several quadrangles that
    /// reach an entry, the nearest tells.
    fn fill(&mut self, corners: [[f64; 2]; 4], first: [f64; 2], distances: &mut [f64]) {
        let range = |i: usize, size: usize| {
            let values = corners.map(|c| (c[i] - self.origin[i]) * self.density[i]);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            ((low - MARGIN).max(0.0) as usize, ((high + MARGIN).max(0.0) as usize + 1).min(size - 1))
        };
        let ((left, right), (top, bottom)) = (range(0, self.cols), range(1, self.rows));
        for r in top..=bottom {
            for c in left..=right {
                let at = [c as f64 / self.density[0] + self.origin[0], r as f64 / self.density[1] + self.origin[1]];
                let Some([a, b]) = inverse_bilinear(corners, at) else { continue };
                let distance = (-a).max(a - 1.0).max(-b).max(b - 1.0).max(0.0);
                let k = r * self.cols + c;
                if distance < distances[k] && distance <= MARGIN * self.spacing {
                    distances[k] = distance;
                    self.pixels[k] = [(first[0] + a) as f32, (first[1] + b) as f32];
                }
            }
        }
    }

    /// The pixel that looks along (u, v, -1); NaN where none does.
    #[inline(always)]
    #[allow(clippy::inline_always)]
    pub(crate) fn read(&self, u: f32, v: f32) -> [f32; 2] {
        let x = (u - self.origin[0] as f32) * self.density[0] as f32;
        let y = (v - self.origin[1] as f32) * self.density[1] as f32;
        if !(x >= 0.0 && y >= 0.0 && x < (self.cols - 1) as f32 && y < (self.rows - 1) as f32) {
            return [f32::NAN; 2];
        }
        let (c, r) = (x as usize, y as usize);
        let (a, b) = (x - c as f32, y - r as f32);
        let k = r * self.cols + c;
        let corners = [self.pixels[k], self.pixels[k + 1], self.pixels[k + self.cols], self.pixels[k + self.cols + 1]];
        let between = |i: usize| {
            let upper = corners[0][i] + a * (corners[1][i] - corners[0][i]);
            let lower = corners[2][i] + a * (corners[3][i] - corners[2][i]);
            upper + b * (lower - upper)
        };
        [between(0), between(1)]
    }

    pub(crate) fn pixel(&self, u: f64, v: f64) -> Option<[f64; 2]> {
        let [col, row] = self.read(u as f32, v as f32);
        (!col.is_nan() && !row.is_nan()).then_some([f64::from(col), f64::from(row)])
    }
}

/// Refuses rays that coincide with or cross those of their neighbours: the derivatives of (u, v) by column and row must
/// keep their orientation all over the frame.
fn check_spread(width: usize, height: usize, rays: &[[f64; 2]]) -> Result<()> {
    for row in 0..height - 1 {
        for col in 0..width - 1 {
            let k = row * width + col;
            let (a, b) = (rays[k + 1], rays[k + width]);
            let by_col = [a[0] - rays[k][0], a[1] - rays[k][1]];
            let by_row = [b[0] - rays[k][0], b[1] - rays[k][1]];
            // u grows along columns, v falls along rows.
            let area = by_col[1] * by_row[0] - by_col[0] * by_row[1];
            let sides = (by_col[0].powi(2) + by_col[1].powi(2)) * (by_row[0].powi(2) + by_row[1].powi(2));
            if area.is_nan() || area <= 1e-3 * sides.sqrt() {
                return Err(Error::DegenerateRay { index: k, why: "it coincides with a neighbour or crosses it" });
            }
        }
    }
    Ok(())
}

/// Fractions (a, b) along columns and rows at which the bilinear mapping of four corners reaches a point.
fn inverse_bilinear(corners: [[f64; 2]; 4], at: [f64; 2]) -> Option<[f64; 2]> {
    let (mut a, mut b) = (0.5, 0.5);
    for _ in 0..STEPS {
        let value = |i: usize| {
            let upper = corners[0][i] + a * (corners[1][i] - corners[0][i]);
            let lower = corners[2][i] + a * (corners[3][i] - corners[2][i]);
            (upper + b * (lower - upper), lower - upper)
        };
        let by_a = |i: usize| (1.0 - b) * (corners[1][i] - corners[0][i]) + b * (corners[3][i] - corners[2][i]);
        let ((x, xb), (y, yb)) = (value(0), value(1));
        let (xa, ya) = (by_a(0), by_a(1));
        let determinant = xa * yb - xb * ya;
        let (dx, dy) = (at[0] - x, at[1] - y);
        a += (dx * yb - dy * xb) / determinant;
        b += (xa * dy - ya * dx) / determinant;
    }
    (a.is_finite() && b.is_finite()).then_some([a, b])
}
