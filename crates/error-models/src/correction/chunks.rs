//! A frame cut into row chunks that do not depend on the number of threads.

use range_image::{Flags, ImageFormat, Raster};
use rayon::prelude::*;

use crate::summary::Tally;
use crate::{Error, FixedPattern, RangeErrorModel, Result};

/// A frame is cut into at most so many chunks of whole rows: enough to keep all cores busy, few enough to
/// stay on the stack.
const MOST_CHUNKS: usize = 64;

/// The planes that a correction reads and writes, all of one size.
pub(crate) struct Planes<'a> {
    pub(crate) range: &'a mut Raster<f32>,
    pub(crate) sigma: Option<&'a mut Raster<f32>>,
    pub(crate) amplitude: &'a Raster<f32>,
    pub(crate) flags: &'a mut Raster<Flags>,
    pub(crate) pattern: Option<&'a FixedPattern>,
}

/// Some rows of all planes.
pub(crate) struct Chunk<'a> {
    pub(crate) first_row: usize,
    pub(crate) range: &'a mut [f32],
    pub(crate) sigma: Option<&'a mut [f32]>,
    pub(crate) amplitude: &'a [f32],
    pub(crate) flags: &'a mut [Flags],
    pub(crate) pattern: Option<&'a [f32]>,
    /// Deviations of the pattern's offsets, where they are known.
    pub(crate) pattern_sigma: Option<&'a [f32]>,
    pub(crate) tally: Tally,
}

impl Planes<'_> {
    /// Refuses a bad model or pattern, and sizes that differ.
    pub(crate) fn validate(
        &self,
        model: &RangeErrorModel,
        format: &ImageFormat,
        principal_point_mm: [f64; 2],
    ) -> Result<()> {
        model.validate()?;
        format.validate()?;
        for coordinate in principal_point_mm {
            crate::error::require_finite("principal_point_mm", coordinate)?;
        }
        self.require_size("image format", format.width, format.height)?;
        self.range.require_same_size(self.amplitude, "amplitude")?;
        self.range.require_same_size(self.flags, "flags")?;
        if let Some(sigma) = &self.sigma {
            self.range.require_same_size(sigma, "sigma")?;
        }
        let Some(pattern) = self.pattern else { return Ok(()) };
        pattern.validate()?;
        self.require_size("fixed pattern", pattern.width, pattern.height)
    }

    fn require_size(&self, what: &'static str, width: usize, height: usize) -> Result<()> {
        if (self.range.width(), self.range.height()) == (width, height) {
            return Ok(());
        }
        Err(Error::Image(range_image::Error::SizeMismatch {
            what,
            width: self.range.width(),
            height: self.range.height(),
            found_width: width,
            found_height: height,
        }))
    }

    /// Runs `work` on all chunks in parallel and adds their tallies in the order of the rows. The error of
    /// the uppermost chunk wins.
    pub(crate) fn for_each_chunk(self, work: impl Fn(&mut Chunk<'_>) -> Result<()> + Sync) -> Result<Tally> {
        let rows = self.range.height().div_ceil(MOST_CHUNKS);
        let length = (rows * self.range.width()).max(1);
        let mut range = self.range.as_mut_slice().chunks_mut(length);
        let mut sigma = self.sigma.map(|plane| plane.as_mut_slice().chunks_mut(length));
        let mut amplitude = self.amplitude.as_slice().chunks(length);
        let mut flags = self.flags.as_mut_slice().chunks_mut(length);
        let mut pattern = self.pattern.map(|pattern| pattern.offset_m.chunks(length));
        let known = self.pattern.filter(|pattern| !pattern.sigma_m.is_empty());
        let mut pattern_sigma = known.map(|pattern| pattern.sigma_m.chunks(length));
        let mut jobs: [Option<(Chunk<'_>, Result<()>)>; MOST_CHUNKS] = std::array::from_fn(|index| {
            let chunk = Chunk {
                first_row: index * rows,
                range: range.next()?,
                sigma: sigma.as_mut().and_then(Iterator::next),
                amplitude: amplitude.next()?,
                flags: flags.next()?,
                pattern: pattern.as_mut().and_then(Iterator::next),
                pattern_sigma: pattern_sigma.as_mut().and_then(Iterator::next),
                tally: Tally::default(),
            };
            Some((chunk, Ok(())))
        });
        jobs.par_iter_mut().flatten().for_each(|(chunk, result)| *result = work(chunk));
        let mut tally = Tally::default();
        for (chunk, result) in jobs.into_iter().flatten() {
            result?;
            tally.add(&chunk.tally);
        }
        Ok(tally)
    }
}

impl FixedPattern {
    /// Refuses a table that does not have `width * height` values, offsets that are not finite, and deviations that are
    /// neither NaN nor positive.
    pub fn validate(&self) -> Result<()> {
        let expected = self.width.saturating_mul(self.height);
        let (width, height, found) = (self.width, self.height, self.offset_m.len());
        if found != expected {
            return Err(Error::Image(range_image::Error::RasterLength { width, height, expected, found }));
        }
        if let Some(found) = Some(self.sigma_m.len()).filter(|found| *found > 0 && *found != expected) {
            return Err(Error::Image(range_image::Error::RasterLength { width, height, expected, found }));
        }
        #[allow(clippy::needless_bitwise_bool)] // a branch would keep the search scalar
        let bad_sigma = |sigma: &&f32| (**sigma < 0.0) | sigma.is_infinite();
        if let Some(sigma) = find_any(&self.sigma_m, bad_sigma) {
            let expected = "a standard deviation is NaN or finite and not negative";
            return Err(Error::OutOfDomain { name: "sigma_m", value: f64::from(*sigma), expected });
        }
        let not_finite = find_any(&self.offset_m, |offset| !offset.is_finite());
        not_finite.map_or(Ok(()), |offset| crate::error::require_finite("offset_m", f64::from(*offset)))
    }
}

/// The first value that is bad. Whole blocks are looked at without a branch, which is several times as fast as a search.
fn find_any(values: &[f32], bad: impl Fn(&&f32) -> bool) -> Option<&f32> {
    let any = |block: &&[f32]| block.iter().fold(0_u32, |any, value| any | u32::from(bad(&value))) > 0;
    values.chunks(1024).find(any)?.iter().find(&bad)
}
