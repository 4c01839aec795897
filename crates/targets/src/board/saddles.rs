//! Saddles of the smoothed image: where two dark and two bright fields may meet.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};
use range_image::Raster;

use crate::grid::nearest::Places;
use crate::image::derivatives::Derivatives;
use crate::image::sampling::bilinear;
use crate::image::smoothing::gaussian;

/// Deviation of the Gaussian before derivatives, pixel of the level. Larger hears less noise, and blends fields of five
/// pixels into grey.
const SCALE: f64 = 1.2;

/// Root of minus the determinant of second derivatives over the deviation that noise gives the mixed one. Of pixels of
/// noise alone about one in ten thousand exceeds it, and of those few pass the ring.
const SIGNIFICANT: f64 = 4.5;

/// Radius of the ring on which a saddle must look like four fields, pixel of the level: half a field of five pixels.
const RING: f64 = 2.5;

/// Samples of the ring, each with its opposite.
const SAMPLES: usize = 16;

/// How much of the ring's variance may differ between opposite sides, beyond what noise does: a corner of one field,
/// a line's end or a texture have a half and more.
const ODD_SHARE: f64 = 0.25;

/// Saddles nearer than this are one, which noise has split, pixel of the level: less than half a field of five pixels.
const APART: f64 = 2.0;

/// Most saddles that are kept, the strongest: a board of 30 x 30 in a picture full of texture.
const MOST: usize = 6000;

/// A saddle of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Saddle {
    /// Pixel of the full image.
    pub(crate) position: Vector2<f64>,
    /// Second derivatives, unit of the image per square pixel of the level.
    pub(crate) hessian: Matrix2<f64>,
    /// Root of minus their determinant.
    pub(crate) strength: f64,
}

impl Saddle {
    /// The directions along which the surface is level, of unit length: those of the two edges.
    pub(crate) fn edges(&self) -> [Vector2<f64>; 2] {
        let eigen = self.hessian.symmetric_eigen();
        let (bright, dark) = if eigen.eigenvalues[0] > eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
        let ratio = (-eigen.eigenvalues[bright] / eigen.eigenvalues[dark]).max(0.0).sqrt();
        let along = eigen.eigenvectors.column(bright).into_owned();
        let across = eigen.eigenvectors.column(dark) * ratio;
        [(along + across).normalize(), (along - across).normalize()]
    }

    /// Second derivative in two directions: positive where the field between them is bright.
    pub(crate) fn mixed(&self, u: Vector2<f64>, v: Vector2<f64>) -> f64 {
        (self.hessian * u).dot(&v)
    }
}

/// The image at one scale of the search.
pub(crate) struct Level {
    /// Smoothed by [`SCALE`] pixels of it.
    pub(crate) smooth: Raster<f32>,
    /// Pixels of the full image along one of its own.
    pub(crate) pixel: f64,
    /// Deviation of the noise after smoothing.
    pub(crate) noise: f64,
}

impl Level {
    /// A level from the image at its size, without holes, and the deviation of the noise there.
    pub(crate) fn new(image: &Raster<f32>, pixel: f64, noise: f64) -> Self {
        // White noise behind a Gaussian: σ / (2√π s).
        Self { smooth: gaussian(image, SCALE), pixel, noise: noise * 0.282_094_791_773_878_1 / SCALE }
    }

    /// The value at a pixel position of the full image.
    pub(crate) fn at(&self, position: Vector2<f64>) -> f64 {
        f64::from(bilinear(&self.smooth, self.own(position).into()))
    }

    fn own(&self, position: Vector2<f64>) -> Vector2<f64> {
        position.map(|value| (value + 0.5) / self.pixel - 0.5)
    }

    fn full(&self, own: Vector2<f64>) -> Vector2<f64> {
        own.map(|value| (value + 0.5) * self.pixel - 0.5)
    }

    /// The saddles that stand out of the noise and look like four fields, the strongest first.
    pub(crate) fn saddles(&self) -> Vec<Saddle> {
        let strengths = self.strengths();
        let (width, height) = (self.smooth.width(), self.smooth.height());
        let values = strengths.as_slice();
        // Noise of the mixed derivative behind a Gaussian: σ / (4√π s³), s² times smaller than that of values over two.
        let least = SIGNIFICANT * self.noise / (2.0 * SCALE * SCALE);
        let mut found = Vec::new();
        for row in 1..height.saturating_sub(1) {
            for col in 1..width.saturating_sub(1) {
                let here = values[row * width + col];
                if f64::from(here) <= least * least || !is_largest(values, width, col, row) {
                    continue;
                }
                found.extend(self.saddle(col, row).filter(|saddle| self.is_like_four_fields(saddle)));
            }
        }
        found.sort_by(|a, b| b.strength.total_cmp(&a.strength));
        let mut found = without_doubles(&found, APART * self.pixel);
        found.truncate(MOST);
        found
    }

    /// Minus the determinant of second derivatives, zero at the rim and where it is negative.
    fn strengths(&self) -> Raster<f32> {
        let (width, height) = (self.smooth.width(), self.smooth.height());
        let mut out = Raster::filled(width, height, 0.0_f32);
        if width < 3 || height < 3 {
            return out;
        }
        let rows: Vec<&[f32]> = self.smooth.rows().collect();
        for (three, to) in rows.windows(3).zip(out.as_mut_slice()[width..].chunks_exact_mut(width)) {
            let [above, here, below] = [three[0], three[1], three[2]];
            for col in 1..width - 1 {
                let twice = 2.0 * here[col];
                let xx = here[col - 1] + here[col + 1] - twice;
                let yy = above[col] + below[col] - twice;
                let xy = 0.25 * (below[col + 1] + above[col - 1] - below[col - 1] - above[col + 1]);
                to[col] = (xy * xy - xx * yy).max(0.0);
            }
        }
        out
    }

    fn saddle(&self, col: usize, row: usize) -> Option<Saddle> {
        let derivatives = Derivatives::at(&self.smooth, col, row)?;
        let offset = Vector2::from(derivatives.stationary()?);
        let [xx, xy, yy] = derivatives.hessian;
        // The place of least gradient of a corner is within a pixel of the strongest saddle.
        let position = self.full(Vector2::new(col as f64, row as f64) + offset);
        let hessian = Matrix2::new(xx, xy, xy, yy);
        (offset.amax() <= 1.0).then_some(Saddle { position, hessian, strength: derivatives.saddle().sqrt() })
    }

    /// Whether a ring about a saddle shows two dark and two bright parts, opposite ones alike.
    fn is_like_four_fields(&self, saddle: &Saddle) -> bool {
        let centre = self.own(saddle.position);
        let ring: [f64; SAMPLES] = std::array::from_fn(|k| {
            let angle = TAU * k as f64 / SAMPLES as f64;
            f64::from(bilinear(&self.smooth, [centre.x + RING * angle.cos(), centre.y + RING * angle.sin()]))
        });
        let mean = ring.iter().sum::<f64>() / SAMPLES as f64;
        let half = SAMPLES / 2;
        let even: [f64; SAMPLES / 2] = std::array::from_fn(|k| 0.5 * (ring[k] + ring[k + half]) - mean);
        let odd: f64 = (0..half).map(|k| (0.5 * (ring[k] - ring[k + half])).powi(2)).sum();
        let total: f64 = even.iter().map(|value| value * value).sum();
        // A sample on an edge may be zero: it goes with either side.
        let changes = (0..half).filter(|&k| (even[k] >= 0.0) != (even[(k + 1) % half] >= 0.0)).count();
        // Written so that a ring beyond the image fails.
        changes == 2 && odd <= ODD_SHARE * total + half as f64 * self.noise * self.noise
    }
}

/// Of saddles with a stronger one within a distance none are kept.
fn without_doubles(saddles: &[Saddle], distance: f64) -> Vec<Saddle> {
    let points: Vec<Vector2<f64>> = saddles.iter().map(|saddle| saddle.position).collect();
    let places = Places::new(&points);
    let is_first = |k: &usize| places.within(points[*k], distance).iter().all(|other| other >= k);
    (0..saddles.len()).filter(is_first).map(|k| saddles[k]).collect()
}

/// Whether a value is the largest of the nine about it; of equal ones the first.
fn is_largest(values: &[f32], width: usize, col: usize, row: usize) -> bool {
    let centre = row * width + col;
    let here = values[centre];
    let before = [centre - width - 1, centre - width, centre - width + 1, centre - 1];
    let after = [centre + 1, centre + width - 1, centre + width, centre + width + 1];
    before.iter().all(|&k| values[k] < here) && after.iter().all(|&k| values[k] <= here)
}
