//! Square blocks of pixels, whose means are observed.

use std::ops::Range;

/// Blocks along the longer side of the image unless told otherwise: scattered light is smooth.
const BLOCKS: f64 = 44.0;
const EDGES: [f64; 2] = [2.0, 8.0];

/// An image cut into blocks; those at the right and lower border may be smaller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::estimate) struct Blocks {
    /// Columns and rows of the image.
    pub(in crate::estimate) pixels: [usize; 2],
    pub(in crate::estimate) edge: usize,
}

impl Blocks {
    pub(in crate::estimate) fn new(pixels: [usize; 2], edge: Option<usize>) -> Self {
        let longer = pixels[0].max(pixels[1]);
        let automatic = (longer as f64 / BLOCKS).round().clamp(EDGES[0], EDGES[1]) as usize;
        Self { pixels, edge: edge.unwrap_or(automatic).clamp(1, longer.max(1)) }
    }

    /// Blocks along a row and along a column.
    pub(in crate::estimate) fn count(&self) -> [usize; 2] {
        self.pixels.map(|pixels| pixels.div_ceil(self.edge))
    }

    /// Pixels of a block along an axis.
    pub(in crate::estimate) fn range(&self, axis: usize, index: usize) -> Range<usize> {
        let start = index * self.edge;
        start..(start + self.edge).min(self.pixels[axis])
    }

    /// Numbers of the pixels of a block, row by row.
    pub(in crate::estimate) fn pixels_of(&self, [col, row]: [usize; 2]) -> impl Iterator<Item = usize> + use<> {
        let (columns, width) = (self.range(0, col), self.pixels[0]);
        self.range(1, row).flat_map(move |row| columns.clone().map(move |col| row * width + col))
    }

    /// All blocks, row by row.
    pub(in crate::estimate) fn all(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [columns, rows] = self.count();
        (0..rows).flat_map(move |row| (0..columns).map(move |col| [col, row]))
    }
}
