//! What a camera would see of the surfaces of a range image: the depth at each of its pixels.
//!
//! Each pixel of the range image is a facet as large as the pixel, and neighbours on one surface are joined by triangles, so that slanted
//! surfaces have no gaps. Over an edge nothing is joined: the nearer surface ends somewhere in the pixel beyond its outermost whole one,
//! and its facets reach over all of that pixel, so that what it may hide counts as hidden.

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use range_image::{Flags, RangeFrame};

/// Slant beyond which two neighbours are two surfaces, tangent of 80 degrees: no camera gives ranges of surfaces that are steeper. A smaller
/// one tears surfaces that are seen at a slant, whose gaps let colours through; a larger one closes the gap between two surfaces, and
/// leaves more points behind an edge without a colour.
const STEEPEST: f64 = 5.67;
/// Deviations of the noise of two ranges that are no step: one in 10,000.
const NOISE: f64 = 4.0;

/// A vertex: column and row in the colour image, and depth before its camera, metre.
type Vertex = [f64; 3];

/// The surfaces of a range image.
pub(super) struct Surfaces<'a> {
    frame: &'a RangeFrame,
    camera: &'a Camera,
    /// Angle between two pixels in the middle of the image, radian.
    pub(super) pixel_rad: f64,
}

impl<'a> Surfaces<'a> {
    pub(super) fn new(frame: &'a RangeFrame, camera: &'a Camera) -> Self {
        let pixel_rad = camera.format.pixel_pitch_mm[0] / camera.interior.principal_distance_mm;
        Self { frame, camera, pixel_rad }
    }

    /// The range of a pixel on a surface; `None` without one, and where it is of two surfaces.
    pub(super) fn range(&self, col: usize, row: usize) -> Option<f64> {
        let range = f64::from(*self.frame.range.get(col, row)?);
        let is_usable = !self.frame.flags[(col, row)].intersects(Flags::NO_DATA | Flags::MIXED_PIXEL);
        (is_usable && range > 0.0 && range.is_finite()).then_some(range)
    }

    /// Standard deviation of a range; zero where none is known.
    pub(super) fn sigma(&self, col: usize, row: usize) -> f64 {
        let sigma = f64::from(self.frame.sigma[(col, row)]);
        if sigma > 0.0 && sigma.is_finite() { sigma } else { 0.0 }
    }

    /// How far the facet of a pixel reaches from its middle, pixel: to its rim, and over the next pixel too where its surface ends before
    /// a farther one, or before a pixel without a range.
    fn reach(&self, (col, row): (usize, usize), range: f64, [dx, dy]: [isize; 2]) -> f64 {
        let beside = col.checked_add_signed(dx).zip(row.checked_add_signed(dy));
        let ends = beside.is_none_or(|other| match self.range(other.0, other.1) {
            Some(there) => there > range && !self.joins([(col, row), other], [range, there]),
            None => true,
        });
        if ends { 1.5 } else { 0.5 }
    }

    /// Whether two neighbours are on one surface.
    pub(super) fn joins(&self, [a, b]: [(usize, usize); 2], ranges: [f64; 2]) -> bool {
        let nearer = ranges[0].min(ranges[1]);
        let noise = NOISE * self.sigma(a.0, a.1).hypot(self.sigma(b.0, b.1));
        // Two steps along columns and rows at once are √2 as long.
        (ranges[0] - ranges[1]).abs() <= std::f64::consts::SQRT_2 * STEEPEST * self.pixel_rad * nearer + noise
    }
}

/// Depths that a camera sees, infinite where it sees nothing.
pub(super) struct DepthImage {
    width: usize,
    height: usize,
    depths: Vec<f64>,
}

impl DepthImage {
    /// What a camera that sits at `camera_from_range` sees of the surfaces.
    pub(super) fn new(surfaces: &Surfaces<'_>, camera: &Camera, camera_from_range: &Isometry3<f64>) -> Self {
        let (width, height) = (camera.format.width, camera.format.height);
        let mut image = Self { width, height, depths: vec![f64::INFINITY; width * height] };
        let vertex = |pixel: [f64; 2], range_m: f64| {
            project(camera, &(camera_from_range * surfaces.camera.point(pixel, range_m)))
        };
        let (columns, rows) = (surfaces.frame.width(), surfaces.frame.height());
        for row in 0..rows {
            for col in 0..columns {
                let Some(range) = surfaces.range(col, row) else { continue };
                let (x, y) = (col as f64, row as f64);
                let reach = |direction| surfaces.reach((col, row), range, direction);
                let [left, right] = [x - reach([-1, 0]), x + reach([1, 0])];
                let [top, bottom] = [y - reach([0, -1]), y + reach([0, 1])];
                let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
                image.add_facet(corners.map(|corner| vertex(corner, range)));
                let places = [(col, row), (col + 1, row), (col + 1, row + 1), (col, row + 1)];
                let [Some(a), Some(b), Some(c), Some(d)] = places.map(|(col, row)| surfaces.range(col, row)) else {
                    continue;
                };
                let ranges = [a, b, c, d];
                let joined = (0..4).all(|k| {
                    let next = (k + 1) % 4;
                    surfaces.joins([places[k], places[next]], [ranges[k], ranges[next]])
                });
                if joined {
                    let at = |k: usize| vertex([places[k].0 as f64, places[k].1 as f64], ranges[k]);
                    image.add_facet([at(0), at(1), at(2), at(3)]);
                }
            }
        }
        image
    }

    /// Depth at a pixel; `None` outside the image.
    pub(super) fn at(&self, [col, row]: [i64; 2]) -> Option<f64> {
        let (col, row) = (usize::try_from(col).ok()?, usize::try_from(row).ok()?);
        (col < self.width && row < self.height).then(|| self.depths[row * self.width + col])
    }

    fn add_facet(&mut self, corners: [Option<Vertex>; 4]) {
        let [Some(a), Some(b), Some(c), Some(d)] = corners else { return };
        self.add_triangle([a, b, c]);
        self.add_triangle([a, c, d]);
    }

    /// Enters the depths of a triangle where they are less than those before.
    fn add_triangle(&mut self, [a, b, c]: [Vertex; 3]) {
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area.is_nan() || area.abs() < 1e-12 {
            return;
        }
        let span = |axis: usize, size: usize| {
            let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            (low.ceil().max(0.0) as usize, (high.floor() + 1.0).clamp(0.0, size as f64) as usize)
        };
        let ((left, right), (top, bottom)) = (span(0, self.width), span(1, self.height));
        for row in top..bottom {
            for col in left..right {
                let (x, y) = (col as f64, row as f64);
                let share = |p: Vertex, q: Vertex| ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area;
                let [of_c, of_a, of_b] = [share(a, b), share(b, c), share(c, a)];
                // A rim belongs to both of its triangles: rounding must not open it.
                if of_a.min(of_b).min(of_c) < -1e-9 {
                    continue;
                }
                // Along a plane the inverse of the depth is linear in the image.
                let depth = 1.0 / (of_a / a[2] + of_b / b[2] + of_c / c[2]);
                let own = &mut self.depths[row * self.width + col];
                *own = own.min(depth);
            }
        }
    }
}

/// Where a camera sees a point of its frame, and how far before it; `None` behind it, and far outside the image, where lens distortion means
/// nothing.
pub(super) fn project(camera: &Camera, point: &Point3<f64>) -> Option<Vertex> {
    let [col, row] = camera.project(point).ok().filter(|_| point.z < 0.0)?;
    let (width, height) = (camera.format.width as f64, camera.format.height as f64);
    let is_near = (-0.25 * width..1.25 * width).contains(&col) && (-0.25 * height..1.25 * height).contains(&row);
    // What the lens folds back into the image is not seen there: a ray leads back to its point.
    let ray = camera.ray([col, row]);
    (is_near && ray.dot(&point.coords.normalize()) > 1.0 - 1e-9).then_some([col, row, -point.z])
}
