//! How slanted the surface is that a pixel sees: the plane through the pixels about it.
//!
//! One over the depth of a plane is linear in the image, whatever its slant. So a plane is fitted to inverse depths, weighted by their
//! noise, and a window holds one plane where what is left is noise. A limit on the jump of ranges between pixels, which finds
//! surfaces for normals, fails on floors that are seen at grazing incidence: there the noise of a pixel decides whether it has a normal,
//! and pixels without one were 0.5 mm too short, in a simulated room a dark range error of 1 mm.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::footprint::Surfaced;

/// Half widths of the windows, pixel, from the largest: seven pixels know a slant best, three reach to the edges.
const HALF_WIDTHS: [isize; 3] = [3, 2, 1];
/// Fewest pixels that tell a plane from an edge.
const FEWEST: usize = 5;
/// Standard deviations of the sum of squares beyond which a window holds more than a plane: by chance, one window in a thousand does.
const ROUGH: f64 = 3.1;

/// The plane through the pixels about one.
#[derive(Clone, Copy)]
pub(super) struct LocalPlane {
    /// Unit normal.
    pub(super) normal: Vector3<f64>,
    /// Range of the plane along the pixel's ray over the pixel's own.
    pub(super) range: f64,
}

/// Fits planes about the pixels of a frame.
pub(super) struct LocalPlanes<'a> {
    surfaced: Surfaced<'a>,
    /// Directions of the rays at unit depth.
    directions: Vec<Vector2<f64>>,
    /// Variance of the noise over the stated one.
    scale: f64,
}

impl<'a> LocalPlanes<'a> {
    /// `scale`: what the standard deviations have to be multiplied by.
    pub(super) fn new(surfaced: Surfaced<'a>, scale: f64) -> Self {
        let width = surfaced.frame.width();
        let direction = |index: usize| {
            let ray = surfaced.camera.ray([(index % width) as f64, (index / width) as f64]);
            Vector2::new(ray.x, ray.y) / -ray.z
        };
        let directions = (0..surfaced.points.len()).map(direction).collect();
        Self { surfaced, directions, scale: scale * scale }
    }

    /// The surface that a pixel sees; `None` where too few pixels tell.
    pub(super) fn about(&self, index: usize) -> Option<LocalPlane> {
        let mut found = None;
        for half_width in HALF_WIDTHS {
            let Some((plane, is_plane)) = self.plane(index, half_width) else { continue };
            if is_plane {
                return Some(plane);
            }
            // No window holds a plane alone: the smallest one is nearest to what the pixel sees, but its own range is nearer.
            found = Some(LocalPlane { range: 1.0, ..plane });
        }
        found
    }

    /// The plane through a window, and whether it holds nothing else.
    fn plane(&self, index: usize, half_width: isize) -> Option<(LocalPlane, bool)> {
        let (mut normal_matrix, mut right, mut squares, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0, 0);
        for (at, inverse, weight) in self.window(index, half_width) {
            let offset = self.directions[at] - self.directions[index];
            let row = Vector3::new(1.0, offset.x, offset.y);
            normal_matrix += weight * row * row.transpose();
            right += weight * inverse * row;
            squares += weight * inverse * inverse;
            count += 1;
        }
        if count < FEWEST {
            return None;
        }
        let plane = normal_matrix.cholesky()?.solve(&right);
        let free = count as f64 - 3.0;
        let left = (squares - plane.dot(&right)) / self.scale;
        let middle = plane.x - plane.yz().dot(&self.directions[index]);
        let normal = Vector3::new(plane.y, plane.z, -middle).try_normalize(0.0)?;
        let found = LocalPlane { normal, range: 1.0 / plane.x };
        Some((found, left <= free + ROUGH * (2.0 * free).sqrt()))
    }

    /// The known pixels of a window with their inverse depths, relative to that of the pixel in the middle, and weights.
    fn window(&self, index: usize, half_width: isize) -> impl Iterator<Item = (usize, f64, f64)> {
        let (width, height) = (self.surfaced.frame.width(), self.surfaced.frame.height());
        let (col, row) = (index % width, index / width);
        let around = move |at: usize, end: usize| {
            at.saturating_sub(half_width.unsigned_abs())..(at + half_width.unsigned_abs() + 1).min(end)
        };
        let points = self.surfaced.points;
        around(row, height).flat_map(move |r| around(col, width).map(move |c| r * width + c)).filter_map(move |at| {
            let inverse = points[index][2] / points[at][2];
            // The noise of a range moves the inverse depth by the same part of it.
            let sigma = inverse * self.surfaced.sigma_m(at) / Vector3::from(points[at]).norm();
            inverse.is_finite().then(|| (at, inverse, 1.0 / (sigma * sigma)))
        })
    }
}
