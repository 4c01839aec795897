//! Wrap counts that the caller knows.

use range_image::Raster;

use crate::grid::Grid;
use crate::surface::Surface;
use crate::{Error, KnownWraps, Result};

/// Known counts as padded index and count. Seeds must lie on used pixels; of a raster, other pixels are passed over.
pub(crate) fn resolve_known(
    grid: &Grid,
    phase: &Raster<f32>,
    surface: &Surface,
    known: KnownWraps<'_>,
) -> Result<Vec<(usize, i32)>> {
    let mut found = Vec::new();
    match known {
        KnownWraps::Nothing => {}
        KnownWraps::Seeds(seeds) => {
            for seed in seeds {
                let unusable = |why| Error::UnusableSeed { col: seed.col, row: seed.row, wraps: seed.wraps, why };
                if seed.col >= grid.width || seed.row >= grid.height {
                    return Err(unusable("lies outside the image"));
                }
                let pixel = grid.index(seed.col, seed.row);
                if !surface.used(pixel) {
                    return Err(unusable("lies on a pixel that is masked out"));
                }
                found.push((pixel, seed.wraps));
            }
        }
        KnownWraps::Raster(raster) => {
            phase.require_same_size(raster, "known wrap counts")?;
            for (start, row) in grid.row_starts().zip(raster.rows()) {
                let counts = row.iter().enumerate().filter_map(|(col, count)| Some((start + col, (*count)?)));
                found.extend(counts.filter(|&(pixel, _)| surface.used(pixel)));
            }
        }
    }
    Ok(found)
}

/// Absolute counts are searched from 0 to the largest: a known count beyond contradicts the options.
pub(crate) fn check_span(grid: &Grid, known: &[(usize, i32)], maximum_wraps: u16) -> Result<()> {
    match known.iter().find(|(_, wraps)| !(0..=i32::from(maximum_wraps)).contains(wraps)) {
        None => Ok(()),
        Some(&(pixel, wraps)) => {
            let (col, row) = (pixel % grid.stride - 1, pixel / grid.stride - 1);
            Err(Error::UnusableSeed { col, row, wraps, why: "is not within 0 and maximum_wraps" })
        }
    }
}
