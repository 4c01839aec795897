//! The rays of all pixels, computed once a camera.

use nalgebra::{Vector2, Vector3};
use range_image::{ImageFormat, Raster};
use rayon::prelude::*;

use crate::{Camera, Error, Result};

/// Pixels handled by one task. Fixed, so that the split does not depend on the number of threads.
pub(crate) const CHUNK: usize = 8192;

/// Unit direction of each pixel's ray in the camera frame, lens taken off.
#[derive(Debug, Clone, PartialEq)]
pub struct RayTable {
    format: ImageFormat,
    directions: Vec<[f64; 3]>,
    /// The same in single precision, for frames that are worked through one after the other: half of the memory is moved.
    single: Vec<[f32; 3]>,
}

impl RayTable {
    /// Computes the rays of all pixels of a camera.
    ///
    /// Fails where the camera is not valid and with [`Error::FoldInsideImage`] where its lens model folds over
    /// inside the image.
    pub fn new(camera: &Camera) -> Result<Self> {
        camera.validate()?;
        let format = camera.format;
        require_no_fold(camera)?;
        let mut directions = reserve(&format)?;
        directions.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, rays)| {
            for (i, ray) in rays.iter_mut().enumerate() {
                let pixel = chunk * CHUNK + i;
                *ray = camera.ray([(pixel % format.width) as f64, (pixel / format.width) as f64]).into();
            }
        });
        let single = directions.iter().map(|ray| ray.map(|coordinate| coordinate as f32)).collect();
        Ok(Self { format, directions, single })
    }

    /// The image format that the table belongs to.
    pub fn format(&self) -> &ImageFormat {
        &self.format
    }

    /// All unit directions (camera frame), row by row.
    pub fn directions(&self) -> &[[f64; 3]] {
        &self.directions
    }

    /// The unit directions in single precision.
    pub(crate) fn single(&self) -> &[[f32; 3]] {
        &self.single
    }

    /// The unit direction of one pixel in the camera frame; NaN outside the image.
    pub fn direction(&self, col: usize, row: usize) -> Vector3<f64> {
        let inside = col < self.format.width && row < self.format.height;
        let found = if inside { self.directions.get(row * self.format.width + col) } else { None };
        Vector3::from(found.copied().unwrap_or([f64::NAN; 3]))
    }

    /// Ranges (metre, along the rays) of a plane of depths (metre, along the viewing axis): `depth / cos(ray angle)`.
    ///
    /// Each value is scaled and nothing else: NaN stays NaN, and a plane of standard deviations may be given as well.
    pub fn depth_to_range(&self, depth: &Raster<f32>) -> Result<Raster<f32>> {
        let mut range = depth.clone();
        self.depth_to_range_in_place(&mut range)?;
        Ok(range)
    }

    /// Depths (metre, along the viewing axis) of a plane of ranges (metre, along the rays): `range * cos(ray angle)`.
    ///
    /// Each value is scaled and nothing else: NaN stays NaN, and a plane of standard deviations may be given as well.
    pub fn range_to_depth(&self, range: &Raster<f32>) -> Result<Raster<f32>> {
        let mut depth = range.clone();
        self.range_to_depth_in_place(&mut depth)?;
        Ok(depth)
    }

    /// [`Self::depth_to_range`] without a new raster.
    pub fn depth_to_range_in_place(&self, plane: &mut Raster<f32>) -> Result<()> {
        self.scale(plane, "depth", |value, cosine| (f64::from(value) / cosine) as f32)
    }

    /// [`Self::range_to_depth`] without a new raster.
    pub fn range_to_depth_in_place(&self, plane: &mut Raster<f32>) -> Result<()> {
        self.scale(plane, "range", |value, cosine| (f64::from(value) * cosine) as f32)
    }

    fn scale(
        &self,
        plane: &mut Raster<f32>,
        what: &'static str,
        scaled: impl Fn(f32, f64) -> f32 + Sync,
    ) -> Result<()> {
        self.require_size(plane, what)?;
        let chunks = plane.as_mut_slice().par_chunks_mut(CHUNK).zip(self.directions.par_chunks(CHUNK));
        chunks.for_each(|(values, rays)| {
            for (value, ray) in values.iter_mut().zip(rays) {
                *value = scaled(*value, -ray[2]);
            }
        });
        Ok(())
    }

    /// Fails unless a plane has the size of the table.
    pub(crate) fn require_size<T>(&self, plane: &Raster<T>, what: &'static str) -> Result<()> {
        self.require(plane.width(), plane.height(), what)
    }

    /// Fails unless a size is that of the table.
    pub(crate) fn require(&self, found_width: usize, found_height: usize, what: &'static str) -> Result<()> {
        let ImageFormat { width, height, .. } = self.format;
        if (found_width, found_height) == (width, height) {
            return Ok(());
        }
        Err(range_image::Error::SizeMismatch { what, width, height, found_width, found_height }.into())
    }
}

/// Memory for one direction a pixel; a size from a damaged file is refused instead of ending the program.
fn reserve(format: &ImageFormat) -> Result<Vec<[f64; 3]>> {
    let mut directions = Vec::new();
    let count = format.width.checked_mul(format.height);
    match count.map(|count| directions.try_reserve_exact(count)) {
        Some(Ok(())) => directions.resize(format.width * format.height, [0.0; 3]),
        _ => {
            return Err(Error::OutOfDomain {
                name: "width * height",
                value: format.width as f64 * format.height as f64,
                expected: "the ray table of an image fits into memory",
            });
        }
    }
    Ok(directions)
}

/// Positions looked at along each side of the image, at least; of smaller images all.
const BORDER_POSITIONS: usize = 1024;

/// Fails where the lens model is not one to one between the principal point and every pixel.
pub(crate) fn require_no_fold(camera: &Camera) -> Result<()> {
    let ImageFormat { width, height, .. } = camera.format;
    let reduced = |col: usize, row: usize| -> Vector2<f64> {
        camera.interior.reduced(camera.format.image_from_pixel([col as f64, row as f64]))
    };
    // The model is looked at along the segments to the pixels, so the border has all of it.
    let along = |size: usize| (0..size).step_by((size / BORDER_POSITIONS).max(1)).chain([size - 1]);
    let top_and_bottom = along(width).flat_map(|col| [(col, 0), (col, height - 1)]);
    let sides = along(height).flat_map(|row| [(0, row), (width - 1, row)]);
    match top_and_bottom.chain(sides).find(|&(col, row)| !camera.lens.one_to_one_to(reduced(col, row))) {
        Some((col, row)) => Err(Error::FoldInsideImage { col, row }),
        None => Ok(()),
    }
}
