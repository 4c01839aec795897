//! Light from beyond the image border, told by what it leaves in dark pixels.

mod blocks;
mod shape;

use fourier_transforms::num_complex::Complex;
use range_image::{ComplexChannel, Flags, Raster};

use crate::kernels::convolution::check_size;
use crate::{Error, Psf, Result};
use blocks::{Block, Blocks};
use shape::{Segment, Shape};

/// Parts of each side that are tried: a quarter of it each, half of which is that of the next.
const SEGMENTS_PER_SIDE: usize = 7;
/// Independent blocks that must be left for the test to mean something: with one, a template has to explain all but a few
/// millionths of the squares.
const MIN_REDUNDANCY: f64 = 1.0;

/// Which pixels return no light of their own, so that all they have is noise and what was not taken off.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum DarkPixels {
    /// Those flagged as [`Flags::LOW_AMPLITUDE`].
    #[default]
    Flagged,
    /// Those with less amplitude after restoration, in the unit of the image.
    Below(f32),
}

/// How light from outside is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutsideLightOptions {
    /// Which pixels are dark. Default: [`DarkPixels::Flagged`].
    pub dark: DarkPixels,
    /// Level of the verdict: probability of an alarm where dark pixels have nothing but noise, or light of their own that is
    /// alike in neighbouring blocks; 0.001 by default.
    pub false_alarm: f64,
    /// Share of a pixel's amplitude beyond which light from outside gets it flagged, if it is above the pixel's sigma as
    /// well: so many radians, 0.05 by default.
    pub flagged_share: f64,
}

impl Default for OutsideLightOptions {
    fn default() -> Self {
        Self { dark: DarkPixels::Flagged, false_alarm: 1e-3, flagged_share: 0.05 }
    }
}

/// A side of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Beyond the first column.
    Left,
    /// Beyond the last column.
    Right,
    /// Beyond the first row.
    Top,
    /// Beyond the last row.
    Bottom,
}

/// What dark pixels say about light from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OutsideLightVerdict {
    /// There are not enough dark blocks, or what is left in them is so alike (light of the scene itself) that they are worth
    /// too few independent ones to tell anything apart.
    NotTestable {
        /// Independent dark blocks beyond those that the fit takes.
        redundancy: f64,
    },
    /// No side explains the dark pixels better than chance does.
    NothingFound {
        /// Probability that chance does as well as the best place.
        p_value: f64,
    },
    /// Light from outside is suspected.
    Suspected(OutsideLight),
}

/// Light that seems to come from beyond one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutsideLight {
    /// Where the object seems to be.
    pub suspected_side: Side,
    /// Middle of the part of that side that explains most, from 0 to 1, in the direction of columns or rows.
    pub position: f64,
    /// The light (real and imaginary part) that it scatters to the nearest pixel of the border.
    pub phasor: [f64; 2],
    /// Modulus of the same.
    pub strength: f64,
    /// Probability that chance explains the dark pixels as well.
    pub p_value: f64,
    /// Pixels flagged.
    pub flagged_pixels: usize,
}

/// Looks for light from outside in restored images of one size.
///
/// Light of an object beyond the border is not in the image, so what it scatters into it stays: smooth, of one phase, and
/// rising towards the object. Where pixels return light of their own it cannot be told from it; in blocks all of whose pixels
/// are dark it is nearly all that there is. The means of these are compared, by least squares, with the light that strips
/// beyond each of 28 parts of the border would scatter, in four distances and depths. The light that the image itself
/// scatters, times any factor, is fitted along, so that a wrong weight of the point spread function raises no alarm; and a
/// strip has to explain the means without that as well, so that light of the scene, uniform or not, raises none. Blocks that
/// are alike in what is left count for less.
pub struct OutsideLightDetector {
    size: [usize; 2],
    options: OutsideLightOptions,
    shape: Shape,
    blocks: Blocks,
    segments: Vec<Segment>,
    /// Light that each segment gives each block.
    templates: Vec<Vec<f64>>,
}

impl OutsideLightDetector {
    /// For images of `width` x `height` pixels.
    ///
    /// # Errors
    /// A point spread function that is not valid or scatters nothing, images that are too large, options without meaning.
    pub fn new(psf: &Psf, width: usize, height: usize, options: &OutsideLightOptions) -> Result<Self> {
        let size = [width, height];
        check_size(size)?;
        options.validate()?;
        let shape = Shape::new(psf, size)?;
        let (blocks, segments) = (Blocks::new(size), Segment::all(SEGMENTS_PER_SIDE));
        let places = blocks.places();
        let template = |&segment: &Segment| places.iter().map(|&place| shape.light(segment, place)).collect();
        let templates = segments.iter().map(template).collect();
        Ok(Self { size, options: *options, shape, blocks, segments, templates })
    }

    /// Tests a restored image, and flags pixels that light from outside changes strongly: light that came by more than one
    /// way is suspected there.
    pub fn detect(&self, channel: &ComplexChannel, flags: &mut Raster<Flags>) -> Result<OutsideLightVerdict> {
        channel.validate()?;
        channel.real.require_same_size(flags, "flags")?;
        if [channel.real.width(), channel.real.height()] != self.size {
            let (expected, found) = (self.size[0] * self.size[1], channel.real.len());
            return Err(Error::PlaneLength { what: "the image", expected, found });
        }
        let is_dark = self.is_dark(flags);
        if !self.blocks.any_dark(channel, is_dark) {
            return Ok(OutsideLightVerdict::NotTestable { redundancy: 0.0 });
        }
        let blocks = self.blocks.of_image(channel, is_dark);
        Ok(match self.explain(&blocks) {
            Explanation::Nothing { redundancy } => OutsideLightVerdict::NotTestable { redundancy },
            Explanation::Best { p_value, .. } if p_value > self.options.false_alarm => {
                OutsideLightVerdict::NothingFound { p_value }
            }
            Explanation::Best { segment, light, p_value } => {
                OutsideLightVerdict::Suspected(self.suspect(segment, light, p_value, channel, flags))
            }
        })
    }

    /// Whether any block of an image, restored or not yet, can be dark: where none is, [`Self::detect`] finds nothing. Of most
    /// frames none is, which a look at the first pixel of each tells.
    pub fn may_detect(&self, channel: &ComplexChannel, flags: &Raster<Flags>) -> bool {
        let fits =
            [&channel.real, &channel.imaginary].into_iter().all(|plane| plane.require_same_size(flags, "").is_ok());
        let restored = matches!(self.options.dark, DarkPixels::Below(_));
        restored
            || !fits
            || [flags.width(), flags.height()] != self.size
            || self.blocks.any_dark(channel, self.is_dark(flags))
    }

    fn is_dark<'a>(&self, flags: &'a Raster<Flags>) -> impl Fn(usize, [f32; 2]) -> bool + Copy + use<'a> {
        let dark = self.options.dark;
        move |pixel: usize, [re, im]: [f32; 2]| match dark {
            DarkPixels::Flagged => flags.as_slice()[pixel].intersects(Flags::LOW_AMPLITUDE),
            DarkPixels::Below(limit) => re.hypot(im) < limit,
        }
    }

    /// The part of the border that explains the dark blocks best.
    fn explain(&self, blocks: &[Block]) -> Explanation {
        let alone = blocks::fit(blocks, &self.templates, None);
        let Some((alone, beside)) = alone
            .and_then(|alone| Some((alone, blocks::fit(blocks, &self.templates, Some(&self.shape.inside(blocks)))?)))
        else {
            return Explanation::Nothing { redundancy: 0.0 };
        };
        let redundancy = alone.redundancy.min(beside.redundancy);
        if redundancy < MIN_REDUNDANCY {
            return Explanation::Nothing { redundancy };
        }
        // The best of all templates was taken, whichever it is: their chances add up.
        let p_value = (self.templates.len() as f64 * alone.chance().max(beside.chance())).min(1.0);
        Explanation::Best { segment: self.segments[beside.template], light: beside.light, p_value }
    }

    fn suspect(
        &self,
        segment: Segment,
        light: Complex<f64>,
        p_value: f64,
        channel: &ComplexChannel,
        flags: &mut Raster<Flags>,
    ) -> OutsideLight {
        let phasor = light * self.shape.light(segment, segment.nearest_pixel(self.size));
        let profiles = self.shape.profiles(segment);
        let limit = self.options.flagged_share;
        let mut flagged_pixels = 0;
        let pixels = channel.real.as_slice().iter().zip(channel.imaginary.as_slice()).zip(channel.sigma.as_slice());
        for (pixel, (flags, ((re, im), sigma))) in flags.as_mut_slice().iter_mut().zip(pixels).enumerate() {
            let share: f64 = profiles.iter().map(|[x, y]| x[pixel % self.size[0]] * y[pixel / self.size[0]]).sum();
            let outside = share * light.norm();
            // What is below the noise does not matter; a pixel of unknown noise is judged by its amplitude alone.
            let hidden = outside <= f64::from(*sigma);
            if !hidden && outside > limit * f64::from(re.hypot(*im)) {
                *flags |= Flags::MULTIPATH;
                flagged_pixels += 1;
            }
        }
        OutsideLight {
            suspected_side: segment.side,
            position: segment.middle(),
            phasor: [phasor.re, phasor.im],
            strength: phasor.norm(),
            p_value,
            flagged_pixels,
        }
    }
}

enum Explanation {
    Nothing { redundancy: f64 },
    Best { segment: Segment, light: Complex<f64>, p_value: f64 },
}

impl OutsideLightOptions {
    /// Fails on values without meaning.
    pub fn validate(&self) -> Result<()> {
        let in_unit = |name, value: f64| {
            let expected = "a probability or a share lies between 0 and 1";
            if value > 0.0 && value < 1.0 { Ok(()) } else { Err(Error::OutOfDomain { name, value, expected }) }
        };
        in_unit("false_alarm", self.false_alarm)?;
        in_unit("flagged_share", self.flagged_share)?;
        match self.dark {
            DarkPixels::Below(limit) if !(limit.is_finite() && limit > 0.0) => {
                let expected = "the amplitude of dark pixels is positive and finite";
                Err(Error::OutOfDomain { name: "dark", value: f64::from(limit), expected })
            }
            _ => Ok(()),
        }
    }
}
