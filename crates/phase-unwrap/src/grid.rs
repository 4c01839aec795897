//! The pixel grid with a rim of one masked pixel, so that no inner loop asks where the image ends.

use std::f32::consts::{PI, TAU};

use range_image::Raster;

use crate::{Error, Result};

/// Bit of a link from a pixel to its right neighbour.
pub(crate) const RIGHT: u8 = 1;
/// Bit of a link from a pixel to the neighbour below.
pub(crate) const DOWN: u8 = 2;

/// Size of the padded grid.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Grid {
    pub width: usize,
    pub height: usize,
    /// Elements from one row to the next.
    pub stride: usize,
}

impl Grid {
    pub fn new(width: usize, height: usize) -> Result<Self> {
        if width == 0 || height == 0 {
            return Err(Error::Empty { width, height });
        }
        let padded = width.saturating_add(2).saturating_mul(height.saturating_add(2));
        if padded >= u32::MAX as usize {
            return Err(Error::TooLarge { pixels: padded });
        }
        Ok(Self { width, height, stride: width + 2 })
    }

    /// Elements of a padded plane.
    pub fn len(&self) -> usize {
        self.stride * (self.height + 2)
    }

    /// Padded index of a pixel.
    pub fn index(&self, col: usize, row: usize) -> usize {
        (row + 1) * self.stride + col + 1
    }

    /// Padded elements that have all four neighbours in the plane.
    pub fn inner(&self) -> std::ops::Range<usize> {
        self.stride..self.len() - self.stride
    }

    /// Start of each image row in a padded plane.
    pub fn row_starts(self) -> impl Iterator<Item = usize> {
        (0..self.height).map(move |row| self.index(0, row))
    }

    /// Copies a raster into a padded plane whose rim keeps `rim`.
    pub fn pad<T: Copy>(&self, raster: &Raster<T>, rim: T, padded: &mut Vec<T>) {
        padded.clear();
        padded.resize(self.len(), rim);
        for (start, row) in self.row_starts().zip(raster.rows()) {
            padded[start..start + self.width].copy_from_slice(row);
        }
    }

    /// Maps the image part of a padded plane to a raster.
    pub fn crop<T, U>(&self, padded: &[T], mut value: impl FnMut(&T) -> U) -> Result<Raster<U>> {
        let mut data = Vec::with_capacity(self.width * self.height);
        for start in self.row_starts() {
            data.extend(padded[start..start + self.width].iter().map(&mut value));
        }
        Ok(Raster::from_vec(self.width, self.height, data)?)
    }
}

/// A difference of two wrapped phases brought into `[-pi, pi]`; odd in its argument, so that a tie at pi has no side.
#[inline]
pub(crate) fn wrapped(difference: f32) -> f32 {
    let high = if difference > PI { TAU } else { 0.0 };
    let low = if difference < -PI { TAU } else { 0.0 };
    difference - high + low
}

/// Wrap count of `to` minus that of `from` when both lie on one continuous surface.
#[inline]
pub(crate) fn wrap_step(from: f32, to: f32) -> i32 {
    i32::from(from - to > PI) - i32::from(from - to < -PI)
}
