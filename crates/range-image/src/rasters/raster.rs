use crate::{Error, Result};

/// A plane of `width * height` values, row by row from the top.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Raster<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

impl<T> Raster<T> {
    /// Takes row-major values; their number must be `width * height`.
    pub fn from_vec(width: usize, height: usize, data: Vec<T>) -> Result<Self> {
        let expected = width.saturating_mul(height);
        if data.len() != expected {
            return Err(Error::RasterLength { width, height, expected, found: data.len() });
        }
        Ok(Self { width, height, data })
    }

    /// Evaluates `value(col, row)` for each pixel.
    pub fn from_fn(width: usize, height: usize, mut value: impl FnMut(usize, usize) -> T) -> Self {
        let data = (0..height).flat_map(|row| (0..width).map(move |col| (col, row)));
        Self { width, height, data: data.map(|(col, row)| value(col, row)).collect() }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.data.len()
    }

    /// Whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    /// The value at a pixel, `None` outside the raster.
    pub fn get(&self, col: usize, row: usize) -> Option<&T> {
        if col < self.width && row < self.height { self.data.get(row * self.width + col) } else { None }
    }

    /// All values, row by row.
    pub fn as_slice(&self) -> &[T] {
        &self.data
    }

    /// All values, row by row.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Gives the values up, row by row.
    pub fn into_vec(self) -> Vec<T> {
        self.data
    }

    /// The rows from the top.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, T> {
        // A raster without columns has no rows to show; chunks of length zero are not allowed.
        self.data.chunks_exact(self.width.max(1))
    }

    /// A raster of the same size with each value mapped.
    pub fn map<U>(&self, value: impl FnMut(&T) -> U) -> Raster<U> {
        Raster { width: self.width, height: self.height, data: self.data.iter().map(value).collect() }
    }

    /// Fails unless `other` has the same size; `what` names it in the error.
    pub fn require_same_size<U>(&self, other: &Raster<U>, what: &'static str) -> Result<()> {
        if (self.width, self.height) == (other.width, other.height) {
            return Ok(());
        }
        Err(Error::SizeMismatch {
            what,
            width: self.width,
            height: self.height,
            found_width: other.width,
            found_height: other.height,
        })
    }
}

impl<T: Clone> Raster<T> {
    /// A raster with one value everywhere.
    pub fn filled(width: usize, height: usize, value: T) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }
}

impl<T> std::ops::Index<(usize, usize)> for Raster<T> {
    type Output = T;

    /// The value at `(col, row)`.
    ///
    /// # Panics
    /// Outside the raster, as slices do; [`Raster::get`] answers `None` instead.
    fn index(&self, (col, row): (usize, usize)) -> &T {
        assert!(col < self.width, "column {col} outside a raster of {} columns", self.width);
        &self.data[row * self.width + col]
    }
}

impl<T> std::ops::IndexMut<(usize, usize)> for Raster<T> {
    fn index_mut(&mut self, (col, row): (usize, usize)) -> &mut T {
        assert!(col < self.width, "column {col} outside a raster of {} columns", self.width);
        &mut self.data[row * self.width + col]
    }
}
