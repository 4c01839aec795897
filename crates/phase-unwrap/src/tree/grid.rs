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

    /// Maps the image part of a padded plane and gives it the plane's memory.
    pub fn image<T: Copy>(&self, mut padded: Vec<T>, value: impl Fn(T) -> T) -> Result<Raster<T>> {
        // Each row moves towards the front, over what has been moved already.
        for (row, start) in self.row_starts().enumerate() {
            for col in 0..self.width {
                padded[row * self.width + col] = value(padded[start + col]);
            }
        }
        padded.truncate(self.width * self.height);
        Ok(Raster::from_vec(self.width, self.height, padded)?)
    }

    /// Maps the image part of a padded plane into a raster, which gets the image's size if it has another.
    pub fn crop<T, U: Copy + Default>(&self, padded: &[T], raster: &mut Raster<U>, value: impl Fn(&T) -> U) {
        if (raster.width(), raster.height()) != (self.width, self.height) {
            *raster = Raster::filled(self.width, self.height, U::default());
        }
        for (start, row) in self.row_starts().zip(raster.as_mut_slice().chunks_exact_mut(self.width)) {
            for (out, padded) in row.iter_mut().zip(&padded[start..start + self.width]) {
                *out = value(padded);
            }
        }
    }
}

/// Positions of the bits set in up to eight bytes, lowest first: bit `b` of byte `i` is at `8 i + b`.
pub(crate) fn set_bits(bytes: &[u8]) -> impl Iterator<Item = usize> {
    let mut word = match bytes.first_chunk() {
        Some(whole) => u64::from_le_bytes(*whole),
        None => bytes.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte)),
    };
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        word &= word.wrapping_sub(1);
        (bit < 64).then_some(bit)
    })
}

/// A difference of two wrapped phases brought into `[-pi, pi]`; odd in its argument, so that a tie at pi has no side.
#[inline]
pub fn wrapped(difference: f32) -> f32 {
    let high = if difference > PI { TAU } else { 0.0 };
    let low = if difference < -PI { TAU } else { 0.0 };
    difference - high + low
}

/// Wrap count of `to` minus that of `from` when both lie on one continuous surface.
#[inline]
pub fn wrap_step(from: f32, to: f32) -> i32 {
    i32::from(from - to > PI) - i32::from(from - to < -PI)
}
