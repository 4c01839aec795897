//! A tile solved by the tree, with what holds around it as known.

use range_image::Raster;

use crate::carried::pixels::HELD;
use crate::carried::tiles::TILE;
use crate::{ImageGeometry, KnownWraps, Result, SpatialOptions, Unwrapped, Unwrapper};

/// What is seen around a tile, pixels on each side: enough for the borders of what lies in it.
const MARGIN: usize = 32;

/// Buffers for windows, all of one size.
#[derive(Debug, Default)]
pub(crate) struct Window {
    unwrapper: Unwrapper,
    phase: Raster<f32>,
    amplitude: Raster<f32>,
    known: Raster<Option<i32>>,
    pub out: Unwrapped,
    /// First column and row.
    pub corner: [usize; 2],
}

/// The frame that a window is cut from.
#[derive(Clone, Copy)]
pub(crate) struct Whole<'a> {
    pub phase: &'a Raster<f32>,
    pub amplitude: &'a Raster<f32>,
    pub wraps: &'a [i32],
    pub state: &'a [u8],
}

/// Columns and rows of a tile.
pub(crate) fn tile_pixels(tile: [usize; 2], width: usize, height: usize) -> [std::ops::Range<usize>; 2] {
    let [col, row] = tile.map(|index| index * TILE);
    [col..(col + TILE).min(width), row..(row + TILE).min(height)]
}

impl Window {
    pub fn resize(&mut self, width: usize, height: usize) {
        let size = [width, height].map(|side| side.min(TILE + 2 * MARGIN));
        let [width, height] = size;
        self.phase = Raster::filled(width, height, f32::NAN);
        self.amplitude = Raster::filled(width, height, f32::NAN);
        self.known = Raster::filled(width, height, None);
    }

    /// Solves the tile at this column and row of tiles. `constant`: amplitude of a typical surface at a range of one interval, as
    /// the whole frame had it. `None` where nothing in the window is used.
    pub fn solve(&mut self, whole: Whole<'_>, tile: [usize; 2], options: &SpatialOptions) -> Result<bool> {
        let (width, height) = (whole.phase.width(), whole.phase.height());
        let [columns, rows] = tile_pixels(tile, width, height);
        let begin = |first: usize, side: usize, window: usize| first.saturating_sub(MARGIN).min(side - window);
        let corner = [begin(columns.start, width, self.phase.width()), begin(rows.start, height, self.phase.height())];
        let mut used = false;
        for row in 0..self.phase.height() {
            for col in 0..self.phase.width() {
                let (x, y) = (corner[0] + col, corner[1] + row);
                let (from, to) = (y * width + x, row * self.phase.width() + col);
                let phase = whole.phase.as_slice()[from];
                used |= phase.is_finite();
                self.phase.as_mut_slice()[to] = phase;
                self.amplitude.as_mut_slice()[to] = whole.amplitude.as_slice()[from];
                let holds = whole.state[from] == HELD && !(columns.contains(&x) && rows.contains(&y));
                self.known.as_mut_slice()[to] = holds.then_some(whole.wraps[from]);
            }
        }
        self.corner = corner;
        if !used {
            return Ok(false);
        }
        let geometry = options.geometry.map(|geometry| ImageGeometry {
            principal_point_px: [0, 1].map(|axis| geometry.principal_point_px[axis] - corner[axis] as f32),
            ..geometry
        });
        self.unwrapper.set_options(SpatialOptions { geometry, ..*options });
        let known = KnownWraps::Raster(&self.known);
        self.unwrapper.unwrap_into(&self.phase, Some(&self.amplitude), None, known, &mut self.out)?;
        Ok(true)
    }
}
