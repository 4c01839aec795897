use range_image::Raster;

use super::codes::{Code, codes, mirrored};
use super::decode::read;
use super::model::RingModel;
use crate::circles::find::{CircleSighting, find_circles};
use crate::circles::options::{CircleOptions, Polarity};
use crate::error::{NotFound, Result};
use crate::image::noise::noise_deviation;

/// How coded rings are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodedOptions {
    /// Sectors of a ring. Default: 14, which have 113 codes.
    pub bits: usize,
    /// How the discs in the rings are looked for. Default: bright discs with at least five pixels across, a contrast of ten
    /// deviations of the noise, otherwise as for [`CircleOptions`].
    pub circles: CircleOptions,
}

impl Default for CodedOptions {
    fn default() -> Self {
        let circles = CircleOptions {
            polarity: Polarity::Bright,
            smallest_semi_axis_px: 1.5,
            smallest_contrast_sigmas: 10.0,
            ..CircleOptions::default()
        };
        Self { bits: 14, circles }
    }
}

/// A coded ring that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CodedSighting {
    /// Its code.
    pub code: Code,
    /// Its disc, with the image point of the target: the centre of the ellipse (see [`crate::centre_of_circle`]).
    pub circle: CircleSighting,
    /// Direction in the image of where sector 0 begins, radian, from the columns towards the rows.
    pub direction_rad: f64,
    /// Whether another target of the image has the same code: which is which cannot be told.
    pub is_repeated: bool,
}

/// Finds coded rings and reads their numbers, by row, then column, of their centres.
///
/// A target is a disc of radius r on free ground of radius 4 r, with a ring from 2 r to 3 r cut into [`CodedOptions::bits`] sectors,
/// each of the colour of the disc or of the ground. A ring that is not one of [`codes`], or whose pixels are in some sector not as its
/// code has them, is left out: it is never corrected to the nearest code.
///
/// # Errors
/// [`crate::Error::Invalid`] for options that cannot be met; [`NotFound::Mirrored`] where more rings are mirror images of codes than
/// codes.
///
/// ```
/// use targets::range_image::Raster;
/// use targets::{CodedOptions, codes, find_coded};
///
/// let code = codes(14)?[17];
/// // A disc of radius 5 about (30, 30), samples of a quarter pixel.
/// let colour = |col: f32, row: f32| {
///     let parts = (col - 30.0).hypot(row - 30.0) / 5.0;
///     let sector = (row - 30.0).atan2(col - 30.0).rem_euclid(std::f32::consts::TAU) * 14.0 / std::f32::consts::TAU;
///     let set = parts < 1.0 || ((2.0..3.0).contains(&parts) && code.is_set(sector as usize));
///     if set { 100.0 } else { 10.0 }
/// };
/// let image = Raster::from_fn(60, 60, |col, row| {
///     let part = |k: usize| colour(col as f32 + 0.25 * (k % 4) as f32 - 0.375, row as f32 + 0.25 * (k / 4) as f32 - 0.375);
///     (0..16).map(part).sum::<f32>() / 16.0
/// });
/// let found = find_coded(&image, &CodedOptions::default())?;
/// assert!(found.len() == 1 && found[0].code.id == 17 && !found[0].is_repeated);
/// # Ok::<(), targets::Error>(())
/// ```
pub fn find_coded(image: &Raster<f32>, options: &CodedOptions) -> Result<Vec<CodedSighting>> {
    let known = codes(options.bits)?;
    let mut found: Vec<CodedSighting> = Vec::new();
    let mut in_mirror = 0;
    let noise = options.circles.noise.unwrap_or_else(|| noise_deviation(image)).max(0.0);
    for circle in find_circles(image, &options.circles)? {
        let Some(reading) = read(image, &circle, options.bits) else { continue };
        let place = |word: u32| known.binary_search_by_key(&word, |code| code.word).ok();
        let [own, mirrored] = [reading.word, mirrored(reading.word, options.bits)].map(place);
        let code = Code { id: own.unwrap_or(known.len()), word: reading.word, bits: options.bits };
        if own.or(mirrored).is_none() || !RingModel::new(&circle, code, reading.start_rad).agrees(image, noise) {
            continue;
        }
        let Some(place) = own else {
            in_mirror += 1;
            continue;
        };
        let [col, row] = circle.ellipse.point(reading.start_rad);
        let direction_rad = (row - circle.ellipse.centre[1]).atan2(col - circle.ellipse.centre[0]);
        found.push(CodedSighting { code: known[place], circle, direction_rad, is_repeated: false });
    }
    if in_mirror > found.len() {
        return Err(NotFound::Mirrored.into());
    }
    let ids: Vec<usize> = found.iter().map(|target| target.code.id).collect();
    for target in &mut found {
        target.is_repeated = ids.iter().filter(|id| **id == target.code.id).count() > 1;
    }
    Ok(found)
}
