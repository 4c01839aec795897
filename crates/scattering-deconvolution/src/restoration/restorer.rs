//! Restoration of complex images.

use range_image::{ComplexChannel, Flags, Modulation, Raster};

use crate::kernels::convolution::check_size;
use crate::restoration::mask::Mask;
use crate::restoration::rows::Left;
use crate::restoration::work::Work;
use crate::{Error, Psf, RestorationOptions, Result};

/// Modulations for which operators are kept.
pub(crate) const MODULATIONS: usize = 8;

/// What a restoration did, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RestorationSummary {
    /// Iterations after the first estimate.
    pub iterations: usize,
    /// Bound of the residual `|y - (z + psf * z)|` that remains, over the largest real or imaginary part of `y`; NaN where
    /// it was not measured ([`Refinement::FilterOnly`](crate::Refinement)).
    pub residual: f64,
    /// Factor by which the standard deviation of noise that is the same everywhere changes.
    pub noise_gain: f64,
    /// Pixels that kept their value: not finite, or saturated where flags were given.
    pub kept_pixels: usize,
    /// Those of them that had no finite value and were filled from their neighbours while light was computed.
    pub filled_pixels: usize,
    /// Pixels whose correction depends strongly on light that is not known, as
    /// [`dependence_limit`](RestorationOptions::dependence_limit) says.
    pub dependent_pixels: usize,
    /// Distance of the nodes on which scattered light was computed, along a row and along a column, in pixels.
    pub grid_spacing: [usize; 2],
}

/// Undoes scattering in complex images of one size.
///
/// Solves `z + psf * z = y` for the light `z` that each pixel would have had, nothing being outside the image: first
/// by the inverse filter, which is right but for the light that was lost over the image border, then by iteration until
/// the residual is below the tolerance. Where the point spread function changes over the field or mirrors the image there
/// is no such filter, and the iteration begins with the light that the observed image would scatter. Made once for a size of image; all buffers are its own, so that restoring
/// allocates nothing after the first image.
pub struct Restorer {
    psf: Psf,
    pub(crate) size: [usize; 2],
    options: RestorationOptions,
    /// One for all modulations, or one for each.
    pub(crate) works: Vec<(Option<Modulation>, Work)>,
    mask: Mask,
    /// What is left to be taken off row by row, of each channel.
    pub(crate) left: Vec<Left>,
}

impl Restorer {
    /// For images of `width` x `height` pixels.
    ///
    /// Where a ghost is late by a way in metres, plans and buffers are made for each modulation when it first comes.
    ///
    /// # Errors
    /// What [`Psf::validate`] and [`RestorationOptions::validate`] find; images that are too large; a point spread
    /// function that cannot be undone.
    pub fn new(psf: &Psf, width: usize, height: usize, options: &RestorationOptions) -> Result<Self> {
        psf.validate()?;
        options.validate()?;
        let size = [width, height];
        check_size(size)?;
        let works = if psf.is_empty() || psf.depends_on_modulation() {
            Vec::new()
        } else {
            vec![(None, Work::new(psf, size, options)?)]
        };
        Ok(Self { psf: psf.clone(), size, options: *options, works, mask: Mask::default(), left: Vec::new() })
    }

    /// Restores one complex image in place and propagates its sigma. Where it fails, the image stays as it was.
    ///
    /// Pixels that are not finite keep their value and disturb no other.
    pub fn restore(&mut self, channel: &mut ComplexChannel) -> Result<RestorationSummary> {
        self.restore_channel(channel, None, None)
    }

    /// As [`Self::restore`]; pixels that are flagged as saturated or without data keep their value as well. What the light
    /// of saturated pixels counts for is [`RestorationOptions::saturated_light`].
    pub fn restore_flagged(
        &mut self,
        channel: &mut ComplexChannel,
        flags: &Raster<Flags>,
    ) -> Result<RestorationSummary> {
        channel.real.require_same_size(flags, "flags")?;
        self.restore_channel(channel, Some(flags.as_slice()), None)
    }

    /// As [`Self::restore_flagged`]; where nothing is put aside, what is to be done is left for each row.
    pub(crate) fn restore_or_leave(
        &mut self,
        channel: &mut ComplexChannel,
        flags: &Raster<Flags>,
        left: &mut Left,
    ) -> Result<RestorationSummary> {
        channel.real.require_same_size(flags, "flags")?;
        self.restore_channel(channel, Some(flags.as_slice()), Some(left))
    }

    /// Restores the two planes (row by row) of an image without sigma.
    ///
    /// # Errors
    /// As [`Self::restore`]; a ghost that is late by a way in metres needs a modulation, so give
    /// [`Psf::at_modulation`] to [`Self::new`].
    pub fn restore_planes(&mut self, real: &mut [f32], imaginary: &mut [f32]) -> Result<RestorationSummary> {
        self.restore_kept(None, [real, imaginary], None, None).map(|(summary, _)| summary)
    }

    /// Pixels of the last restored image whose correction depends strongly on light that is not known, in order: that of
    /// saturated pixels and of those without a value.
    pub fn dependent_pixels(&self) -> &[usize] {
        self.mask.dependent()
    }

    fn restore_channel(
        &mut self,
        channel: &mut ComplexChannel,
        flags: Option<&[Flags]>,
        mut left: Option<&mut Left>,
    ) -> Result<RestorationSummary> {
        channel.validate()?;
        let size = [channel.real.width(), channel.real.height()];
        if size != self.size {
            let [width, height] = self.size;
            let [found_width, found_height] = size;
            let what = "the image";
            return Err(range_image::Error::SizeMismatch { what, width, height, found_width, found_height }.into());
        }
        let planes = [channel.real.as_mut_slice(), channel.imaginary.as_mut_slice()];
        let (summary, index) = self.restore_kept(Some(&channel.modulation), planes, flags, left.as_deref_mut())?;
        let sigma = channel.sigma.as_mut_slice();
        let Some((_, work)) = index.and_then(|index| self.works.get_mut(index)) else { return Ok(summary) };
        if let Some(left) = left.filter(|left| left.work.is_some()) {
            let gain = work.gain_of_all(sigma);
            left.gain = gain.unwrap_or(1.0);
            if gain.is_some() {
                return Ok(summary);
            }
        }
        work.propagate_sigma(sigma, &self.mask);
        Ok(summary)
    }

    /// The summary and which operators were used.
    fn restore_kept(
        &mut self,
        modulation: Option<&Modulation>,
        [real, imaginary]: [&mut [f32]; 2],
        flags: Option<&[Flags]>,
        left: Option<&mut Left>,
    ) -> Result<(RestorationSummary, Option<usize>)> {
        let expected = self.size[0] * self.size[1];
        for (what, plane) in [("real part", &*real), ("imaginary part", &*imaginary)] {
            if plane.len() != expected {
                return Err(Error::PlaneLength { what, expected, found: plane.len() });
            }
        }
        let index = self.work_index(modulation)?;
        let Self { mask, works, options, size, .. } = self;
        let largest = mask.put_aside(size[0], real, imaginary, flags, options.saturated_light);
        let mut work = index.and_then(|index| works.get_mut(index)).map(|(_, work)| work);
        let outcome = work.as_mut().map_or(Ok((0, 0.0)), |work| {
            let found = work.solve(real, imaginary, f64::from(largest), options)?;
            if let Some(left) = left.filter(|_| mask.kept() == 0) {
                work.leave(left);
                left.work = index;
            } else {
                work.take_off(real, imaginary);
                work.find_dependent(real, imaginary, mask, options.dependence_limit);
            }
            Ok::<_, Error>(found)
        });
        mask.put_back(real, imaginary);
        let (iterations, residual) = outcome?;
        let summary = RestorationSummary {
            iterations,
            residual,
            noise_gain: work.as_ref().map_or(1.0, |work| work.model.noise.gain()),
            kept_pixels: mask.kept(),
            filled_pixels: mask.filled(),
            dependent_pixels: mask.dependent().len(),
            grid_spacing: work.as_ref().map_or([1, 1], |work| work.grid.spacing()),
        };
        Ok((summary, index))
    }

    /// Which operators are for images of a modulation; none where nothing is scattered.
    fn work_index(&mut self, modulation: Option<&Modulation>) -> Result<Option<usize>> {
        if self.psf.is_empty() {
            return Ok(None);
        }
        let key = modulation.copied().filter(|_| self.psf.depends_on_modulation());
        if let Some(index) = self.works.iter().position(|(known, _)| *known == key) {
            return Ok(Some(index));
        }
        let psf = key.map_or_else(|| self.psf.clone(), |modulation| self.psf.at_modulation(&modulation));
        let work = Work::new(&psf, self.size, &self.options)?;
        self.works.truncate(MODULATIONS - 1);
        self.works.push((key, work));
        Ok(Some(self.works.len() - 1))
    }
}
