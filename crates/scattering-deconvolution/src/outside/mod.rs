//! Light from beyond the image border, told by what it leaves in dark pixels.

mod blocks;
mod shape;

use range_image::{ComplexChannel, Flags, Raster};
use rustfft::num_complex::Complex;

use crate::convolution::check_size;
use crate::{Error, Psf, Result};
use blocks::{Block, Blocks};
use shape::{Segment, Shape};

/// Parts of each side that are tried: a quarter of it each, half of which is that of the next.
const SEGMENTS_PER_SIDE: usize = 7;

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
    /// Which pixels are dark.
    pub dark: DarkPixels,
    /// Probability of an alarm where there is nothing but noise.
    pub false_alarm: f64,
    /// Share of a pixel's amplitude beyond which light from outside gets it flagged: so many radians.
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
    /// There are not enough blocks with dark pixels, or they tell nothing apart.
    NotTestable {
        /// Blocks with dark pixels, as many as are worth independent ones.
        independent_blocks: f64,
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
/// rising towards the object. Where pixels return light of their own it cannot be told from it; in dark pixels it is all
/// that there is. Their block means are compared, by least squares, with the light that a strip beyond each of 28 parts
/// of the border would scatter; a constant, and the light that the image itself scatters, times any factor, are fitted
/// along, so that neither a uniform remainder nor a wrong weight of the point spread function raises an alarm. Neighbouring
/// blocks that are wrong alike count for less.
pub struct OutsideLightDetector {
    size: [usize; 2],
    options: OutsideLightOptions,
    shape: Shape,
    blocks: Blocks,
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
        Ok(Self { size, options: *options, blocks: Blocks::new(size), shape })
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
        let dark = self.options.dark;
        let is_dark = |pixel: usize, amplitude: f32| match dark {
            DarkPixels::Flagged => flags.as_slice()[pixel].intersects(Flags::LOW_AMPLITUDE),
            DarkPixels::Below(limit) => amplitude < limit,
        };
        let blocks = self.blocks.of_image(channel, is_dark);
        Ok(match self.explain(&blocks) {
            Explanation::Nothing { independent_blocks } => OutsideLightVerdict::NotTestable { independent_blocks },
            Explanation::Best { p_value, .. } if p_value > self.options.false_alarm => {
                OutsideLightVerdict::NothingFound { p_value }
            }
            Explanation::Best { segment, light, p_value } => {
                OutsideLightVerdict::Suspected(self.suspect(segment, light, p_value, channel, flags))
            }
        })
    }

    /// The part of the border that explains the dark blocks best.
    fn explain(&self, blocks: &[Block]) -> Explanation {
        let segments = Segment::all(SEGMENTS_PER_SIDE);
        let template = |&segment: &Segment| blocks.iter().map(|block| self.shape.light(segment, block.place)).collect();
        let templates: Vec<Vec<f64>> = segments.iter().map(template).collect();
        let Some(fit) = blocks::fit(blocks, &self.shape.inside(blocks), &templates) else {
            return Explanation::Nothing { independent_blocks: 0.0 };
        };
        // Three complex factors are fitted; with as many left the test means something.
        let spare = fit.independent_blocks - 3.0;
        if spare < 3.0 {
            return Explanation::Nothing { independent_blocks: fit.independent_blocks };
        }
        let p_value = (segments.len() as f64 * fit.unexplained.powf(spare)).min(1.0);
        Explanation::Best { segment: segments[fit.template], light: fit.light, p_value }
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
        let pixels = channel.real.as_slice().iter().zip(channel.imaginary.as_slice());
        for (pixel, (flags, (re, im))) in flags.as_mut_slice().iter_mut().zip(pixels).enumerate() {
            let share: f64 = profiles.iter().map(|[x, y]| x[pixel % self.size[0]] * y[pixel / self.size[0]]).sum();
            if share * light.norm() > limit * f64::from(re.hypot(*im)) {
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
    Nothing { independent_blocks: f64 },
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
