//! Wrap counts that the caller knows.

use range_image::Raster;

use crate::image::surface::Surface;
use crate::tree::cycle::split;
use crate::tree::grid::{Grid, wrap_step};
use crate::{Error, KnownWraps, Result, Unwrapped};

/// Cost, in nats, of going against what the caller states. More than all else that speaks about a segment.
const AGAINST_SEED: f32 = 40.0;
/// Cost, in nats, of going against the frame before. That frame may have erred, and what speaks for its counts speaks
/// again in this one: so much that it decides where the image is undecided, and gives way where the image is clear.
const AGAINST_PREVIOUS: f32 = 6.0;

/// Counts known beforehand.
#[derive(Debug, Default)]
pub(crate) struct Known {
    /// Padded index and count.
    pub pixels: Vec<(usize, i32)>,
    /// Cost, in nats, of going against all of a segment's.
    pub nats: f32,
    /// Whether they are absolute; those of a frame without amplitudes are not.
    pub absolute: bool,
}

/// Seeds must lie on used pixels; of rasters, other pixels are passed over. Where `maximum_wraps` is given, what a frame
/// before predicts beyond it is passed over as well. Known counts belong to the `phase` given; those found, to the phase
/// taken into the cycle.
pub(crate) fn resolve_known(
    grid: &Grid,
    phase: &Raster<f32>,
    surface: &Surface,
    known: KnownWraps<'_>,
    maximum_wraps: Option<u16>,
) -> Result<Known> {
    let mut found = Known { nats: AGAINST_SEED, absolute: true, ..Known::default() };
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
                found.pixels.push((pixel, seed.wraps.saturating_add(split(phase[(seed.col, seed.row)]).1)));
            }
        }
        KnownWraps::Raster(raster) => {
            phase.require_same_size(raster, "known wrap counts")?;
            for ((start, row), phases) in grid.row_starts().zip(raster.rows()).zip(phase.rows()) {
                let counts = row.iter().zip(phases).enumerate();
                let counts = counts
                    .filter_map(|(col, (count, phase))| Some((start + col, (*count)?.saturating_add(split(*phase).1))));
                found.pixels.extend(counts.filter(|&(pixel, _)| surface.used(pixel)));
            }
        }
        KnownWraps::Previous { phase: before, unwrapped, minimum_confidence } => {
            phase.require_same_size(before, "phase of the previous frame")?;
            phase.require_same_size(&unwrapped.wraps, "wrap counts of the previous frame")?;
            phase.require_same_size(&unwrapped.confidence, "confidence of the previous frame")?;
            found.nats = AGAINST_PREVIOUS;
            found.absolute = unwrapped.islands.iter().all(|island| island.offset_known);
            let span = maximum_wraps.map_or(i32::MIN..=i32::MAX, |maximum| 0..=i32::from(maximum));
            let predicted = predict(grid, surface, before, unwrapped, minimum_confidence);
            // What left the span has no count to keep: it moved by more than half an interval.
            found.pixels.extend(predicted.filter(|(_, count)| span.contains(count)));
        }
    }
    Ok(found)
}

/// Counts of the frame before, moved by the cycles that phases passed meanwhile.
fn predict(
    grid: &Grid,
    surface: &Surface,
    before: &Raster<f32>,
    unwrapped: &Unwrapped,
    minimum_confidence: f32,
) -> impl Iterator<Item = (usize, i32)> {
    let planes = before.as_slice().iter().zip(unwrapped.wraps.as_slice()).zip(unwrapped.confidence.as_slice());
    let (width, grid) = (grid.width, *grid);
    planes.enumerate().filter_map(move |(index, ((&before, &wraps), &confidence))| {
        let pixel = grid.index(index % width, index / width);
        let usable = confidence >= minimum_confidence && before.is_finite() && surface.used(pixel);
        usable.then(|| {
            let (before, turns) = split(before);
            (pixel, wraps.saturating_add(turns).saturating_add(wrap_step(before, surface.phase[pixel])))
        })
    })
}

/// Absolute counts are searched from 0 to the largest: a known count beyond contradicts the options.
pub(crate) fn check_span(grid: &Grid, known: &Known, maximum_wraps: u16) -> Result<()> {
    match known.pixels.iter().find(|(_, wraps)| !(0..=i32::from(maximum_wraps)).contains(wraps)) {
        None => Ok(()),
        Some(&(pixel, wraps)) => {
            let (col, row) = (pixel % grid.stride - 1, pixel / grid.stride - 1);
            Err(Error::UnusableSeed { col, row, wraps, why: "is not within 0 and maximum_wraps" })
        }
    }
}
