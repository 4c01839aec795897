//! How points of a camera fall on its pixels.

use std::sync::Arc;

use rigid_pose::{InputError, require_length, require_option};

use nalgebra::Point3;

use crate::error::{Error, Result};
use crate::preparation::grid::Grid;
use crate::preparation::table::Table;

/// Largest size of a frame along one side, pixels.
const MAX_SIDE: usize = 1 << 14;
/// Rays that lie within this distance of those of a pinhole camera are taken for them, pixels.
const PINHOLE_TOLERANCE_PX: f64 = 1e-3;

/// How points of a camera fall on its pixels. It knows no lens: a pinhole, or a table made from one ray a pixel.
///
/// Camera frame: x right, y up, the camera looks along -z. Pixels `(col, row)`, integers at their centres.
#[derive(Debug)]
pub struct Projection {
    width: usize,
    height: usize,
    lens: Lens,
    /// Fine, and twice as coarse for frames whose noise leaves small planes without direction.
    pub(crate) grids: [Arc<Grid>; 2],
}

/// The part of a [`Projection`] that turns directions into pixels.
#[derive(Debug)]
pub(crate) enum Lens {
    Pinhole { focal_px: [f64; 2], centre_px: [f64; 2] },
    Table(Table),
}

impl Projection {
    /// A pinhole camera: focal lengths along columns and rows, and the principal point `(col, row)`, pixels.
    ///
    /// # Errors
    /// [`InputError::InvalidOption`] where the frame has fewer than 8 or more than 16384 pixels along a side, a focal length
    /// is not positive, or the principal point is not finite.
    pub fn pinhole(width: usize, height: usize, focal_px: [f64; 2], centre_px: [f64; 2]) -> Result<Self> {
        check_size(width, height)?;
        for value in focal_px {
            require_option("focal_px", value, "0.001 to 1e9", |focal| focal > 1e-3 && focal < 1e9)?;
        }
        for value in centre_px {
            require_option("centre_px", value, "-1e9 to 1e9", |centre| centre.abs() <= 1e9)?;
        }
        let lens = Lens::Pinhole { focal_px, centre_px };
        let ray = |col: usize, row: usize| {
            [(col as f64 - centre_px[0]) / focal_px[0], (centre_px[1] - row as f64) / focal_px[1]]
        };
        let grids = Grid::fine_and_coarse(width, height, &lens, ray);
        Ok(Self { width, height, lens, grids })
    }

    /// A camera with one ray a pixel: `width · height` directions in the camera frame, row by row, of any length.
    ///
    /// Rays of a pinhole camera (within a thousandth of a pixel) are recognised; for all others a table over x/z and
    /// y/z is made that tells the pixel.
    ///
    /// # Errors
    /// [`InputError::LengthMismatch`] where the directions do not fill the frame; [`InputError::NonFinite`];
    /// [`Error::DegenerateRay`] where a ray does not lead forwards (-z) or neighbouring rays coincide or cross;
    /// [`InputError::InvalidOption`] for the size, as [`Projection::pinhole`].
    pub fn from_directions(width: usize, height: usize, directions: &[[f64; 3]]) -> Result<Self> {
        check_size(width, height)?;
        let expected = width * height;
        require_length("directions", expected, directions.len())?;
        let mut rays = Vec::with_capacity(expected);
        for (index, d) in directions.iter().enumerate() {
            if d.iter().any(|v| !v.is_finite()) {
                return Err(InputError::NonFinite { what: "directions", index }.into());
            }
            let ray = [-d[0] / d[2], -d[1] / d[2]];
            // Rays beyond 85 degrees from the axis.
            if d[2] >= 0.0 || ray.iter().any(|r| r.is_nan() || r.abs() > 12.0) {
                return Err(Error::DegenerateRay { index, why: "it does not lead forwards, along -z" });
            }
            rays.push(ray);
        }
        if let Some((focal_px, centre_px)) = as_pinhole(width, height, &rays) {
            return Self::pinhole(width, height, focal_px, centre_px);
        }
        let lens = Lens::Table(Table::new(width, height, &rays)?);
        let grids = Grid::fine_and_coarse(width, height, &lens, |col, row| rays[row * width + col]);
        Ok(Self { width, height, lens, grids })
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Where a point in the camera frame falls, `(col, row)`; `None` outside the frame and behind the camera.
    pub fn pixel(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        if point.z >= 0.0 || !(point.x + point.y + point.z).is_finite() {
            return None;
        }
        let (u, v) = (-point.x / point.z, -point.y / point.z);
        let [col, row] = match &self.lens {
            Lens::Pinhole { focal_px, centre_px } => [u * focal_px[0] + centre_px[0], centre_px[1] - v * focal_px[1]],
            Lens::Table(table) => table.pixel(u, v)?,
        };
        let inside = |x: f64, size: usize| (-0.5..size as f64 - 0.5).contains(&x);
        (inside(col, self.width) && inside(row, self.height)).then_some([col, row])
    }
}

fn check_size(width: usize, height: usize) -> Result<()> {
    for side in [width, height] {
        require_option("width and height", side as f64, "8 to 16384", |_| (8..=MAX_SIDE).contains(&side))?;
    }
    Ok(())
}

/// Focal lengths and principal point, if these are the rays of a pinhole camera.
fn as_pinhole(width: usize, height: usize, rays: &[[f64; 2]]) -> Option<([f64; 2], [f64; 2])> {
    let (first, last) = (rays[0], rays[rays.len() - 1]);
    let focal = [(width as f64 - 1.0) / (last[0] - first[0]), (height as f64 - 1.0) / (first[1] - last[1])];
    let centre = [-first[0] * focal[0], first[1] * focal[1]];
    let fits = |(k, ray): (usize, &[f64; 2])| {
        let col = ray[0] * focal[0] + centre[0] - (k % width) as f64;
        let row = centre[1] - ray[1] * focal[1] - (k / width) as f64;
        col.abs() < PINHOLE_TOLERANCE_PX && row.abs() < PINHOLE_TOLERANCE_PX
    };
    (focal.iter().all(|f| *f > 1e-3) && rays.iter().enumerate().all(fits)).then_some((focal, centre))
}
