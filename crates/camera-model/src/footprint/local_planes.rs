//! How slanted the surface is that a pixel sees: the plane through the pixels about it.
//!
//! One over the depth of a plane is linear in the image, whatever its slant. So a plane is fitted to inverse depths, weighted by their
//! noise, and a window holds one plane where what is left is noise. A limit on the jump of ranges between pixels, which finds
//! surfaces for normals, fails on floors that are seen at grazing incidence: there the noise of a pixel decides whether it has a normal,
//! and pixels without one were 0.5 mm too short, in a simulated room a dark range error of 1 mm.

use std::ops::Range;

use nalgebra::Vector3;

use super::Seen;

/// Half widths of the windows, pixel, from the largest: seven pixels know a slant best, three reach to the edges.
const HALF_WIDTHS: [usize; 3] = [3, 2, 1];
/// Fewest pixels that tell a plane from an edge.
const FEWEST: f64 = 5.0;
/// One less the squared correlation of columns and rows below which pixels lie in one line, and tell no plane: rounding leaves 1e-10.
const IN_LINE: f64 = 1e-6;
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
    seen: &'a [Seen],
    width: usize,
    /// Variance of the noise over the stated one.
    scale: f64,
}

/// Sums over pixels: weights times products of direction x and y and inverse depth z (1, x, y, xx, xy, yy, z, zx, zy, zz), and the
/// number of known pixels.
type Sums = [f64; 11];

/// Sums down the columns of the windows of one row, by half width.
pub(super) struct ColumnSums([Vec<Sums>; HALF_WIDTHS.len()]);

impl ColumnSums {
    /// Memory for rows of so many pixels.
    pub(super) fn new(width: usize) -> Self {
        Self([(); HALF_WIDTHS.len()].map(|()| vec![Sums::default(); width]))
    }
}

impl<'a> LocalPlanes<'a> {
    /// `scale`: what the standard deviations have to be multiplied by.
    pub(super) fn new(seen: &'a [Seen], width: usize, scale: f64) -> Self {
        Self { seen, width, scale: scale * scale }
    }

    /// Sums down the columns about a row.
    pub(super) fn sum(&self, row: usize, ColumnSums(sums): &mut ColumnSums) {
        let height = self.seen.len() / self.width;
        let mut summed = row..row;
        // From the smallest window: a larger one has its rows and further ones.
        for number in (0..HALF_WIDTHS.len()).rev() {
            let (larger, smaller) = sums.split_at_mut(number + 1);
            let Some(sums) = larger.last_mut() else { continue };
            match smaller.first() {
                Some(smaller) => sums.copy_from_slice(smaller),
                None => sums.fill(Sums::default()),
            }
            let rows = around(row, height, HALF_WIDTHS[number]);
            for row in rows.clone().filter(|row| !summed.contains(row)) {
                let seen = &self.seen[row * self.width..][..self.width];
                sums.iter_mut().zip(seen).for_each(|(sums, seen)| seen.add_to(sums));
            }
            summed = rows;
        }
    }

    /// The surface that a pixel of the summed row sees; `None` where too few pixels tell.
    pub(super) fn about(&self, index: usize, sums: &ColumnSums) -> Option<LocalPlane> {
        let mut found = None;
        for (columns, half_width) in sums.0.iter().zip(HALF_WIDTHS) {
            let mut window = Sums::default();
            for column in &columns[around(index % self.width, self.width, half_width)] {
                window.iter_mut().zip(column).for_each(|(sum, column)| *sum += column);
            }
            let Some((plane, is_plane)) = self.plane(&self.seen[index], &window) else { continue };
            if is_plane {
                return Some(plane);
            }
            // No window holds a plane alone: the smallest one is nearest to what the pixel sees, but its own range is nearer.
            found = Some(LocalPlane { range: 1.0, ..plane });
        }
        found
    }

    /// The plane through a window, and whether it holds nothing else.
    fn plane(&self, own: &Seen, window: &Sums) -> Option<(LocalPlane, bool)> {
        let [w, wx, wy, wxx, wxy, wyy, wz, wzx, wzy, wzz, count] = *window;
        if count < FEWEST {
            return None;
        }
        // Moments about the weighted mean.
        let [mean_x, mean_y, mean_z] = [wx / w, wy / w, wz / w];
        let [xx, xy, yy] = [wxx - wx * mean_x, wxy - wx * mean_y, wyy - wy * mean_y];
        let [zx, zy, zz] = [wzx - wz * mean_x, wzy - wz * mean_y, wzz - wz * mean_z];
        let determinant = xx * yy - xy * xy;
        if determinant <= IN_LINE * xx * yy {
            return None;
        }
        let [by_x, by_y] = [(yy * zx - xy * zy) / determinant, (xx * zy - xy * zx) / determinant];
        let [x, y] = own.direction;
        // Inverse depth of the plane where direction is zero, and on the pixel's ray.
        let at_zero = mean_z - by_x * mean_x - by_y * mean_y;
        let at_pixel = at_zero + by_x * x + by_y * y;
        let normal = Vector3::new(by_x, by_y, -at_zero).try_normalize(0.0)?;
        let (free, left) = (count - 3.0, (zz - by_x * zx - by_y * zy) / self.scale);
        let found = LocalPlane { normal, range: own.inverse / at_pixel };
        Some((found, left <= free + ROUGH * (2.0 * free).sqrt()))
    }
}

impl Seen {
    fn add_to(&self, sums: &mut Sums) {
        let ([x, y], z, w) = (self.direction, self.inverse, self.weight);
        let known = if self.is_known() { 1.0 } else { 0.0 };
        let (wx, wy, wz) = (w * x, w * y, w * z);
        let all = [w, wx, wy, wx * x, wx * y, wy * y, wz, wz * x, wz * y, wz * z, known];
        sums.iter_mut().zip(all).for_each(|(sum, value)| *sum += value);
    }
}

/// The columns or rows of a window.
pub(super) fn around(at: usize, end: usize, half_width: usize) -> Range<usize> {
    at.saturating_sub(half_width)..(at + half_width + 1).min(end)
}
