//! What becomes of mixed pixels: dropped, flagged, or split into the two surfaces that they see.

use range_image::{ComplexFrame, Flags, Modulation, RangeFrame, Raster};
use rayon::prelude::*;
use statistics::chi_squared_limit;

use crate::error::{require_positive, require_probability};
use crate::mixture::split::{split_complex, split_range};
use crate::mixture::surfaces::{Around, Sides, SurfaceFinder};
use crate::pixels::pixel::{MAXIMUM_FREQUENCIES, System, USELESS};
use crate::{FrequencyResponse, Result, Systematics};

/// A surface must have at least this many of its share's standard deviations: with less, noise alone may have made it. A
/// larger one leaves more pixels at the rim of thin objects whole.
const LEAST_SHARE_SIGMAS: f64 = 3.0;

/// What is done with a mixed pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum MixedPixelTreatment {
    /// Range and sigma become NaN; the flags say why.
    Drop,
    /// The pixel keeps its value and is flagged.
    #[default]
    Flag,
    /// As [`Self::Flag`], and where the two surfaces are known the pixel gives a point on each.
    Split,
}

/// How mixed pixels are split.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct SplitOptions {
    /// Modulation frequency at level range, hertz; `None`, the default, takes the range of a mixed pixel for the mean
    /// of the two weighted by amplitude, which is the limit of small phases. Not used where there is a complex image.
    pub modulation_hz: Option<f64>,
    /// Standard deviation of a range where the frame gives none, metre. Default: 0.005 m.
    pub unknown_sigma_m: f64,
    /// Probability that a pixel of two surfaces is refused. Default: 1e-3.
    pub false_alarm: f64,
    /// What calibration leaves over; `floor_m` stands for the bend of surfaces as well. Default: that of
    /// [`Systematics`].
    pub systematics: Systematics,
}

impl Default for SplitOptions {
    /// Small phases; 5 mm where sigma is not known; refusals of one in a thousand; 2 mm and 1 %.
    fn default() -> Self {
        Self { modulation_hz: None, unknown_sigma_m: 0.005, false_alarm: 1e-3, systematics: Systematics::default() }
    }
}

impl SplitOptions {
    fn validate(&self) -> Result<()> {
        require_positive("unknown_sigma_m", self.unknown_sigma_m)?;
        require_probability("false_alarm", self.false_alarm)?;
        self.systematics.validate()
    }
}

/// The complex image of a frame whose mixed pixels are split, and the response of its frequencies.
#[derive(Debug, Clone, Copy)]
pub struct ComplexImage<'a> {
    /// One frequency or more; phases free of each frequency's own range errors, as the ranges of the frame are.
    pub frame: &'a ComplexFrame,
    /// Contrast at each frequency.
    pub response: &'a FrequencyResponse,
}

/// One of the two surfaces of a split pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Range along the pixel's ray, metre.
    pub range_m: f64,
    /// Its standard deviation, metre.
    pub sigma_m: f64,
    /// Its share of the pixel's light, 0 to 1.
    pub share: f64,
    /// Its amplitude, unit of the frame's; NaN where that has none.
    pub amplitude: f64,
}

/// A pixel that sees two surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SplitPixel {
    /// Column.
    pub col: usize,
    /// Row.
    pub row: usize,
    /// The nearer surface.
    pub foreground: SurfacePoint,
    /// The farther surface.
    pub background: SurfacePoint,
    /// Standard deviation of either share.
    pub sigma_share: f64,
    /// Weighted squares left over, with `2 F - 2` degrees of freedom at F frequencies; `None` where one frequency, or the
    /// range alone, leaves nothing to test.
    pub chi_squared: Option<f64>,
}

/// Why a mixed pixel is not split.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum NotSplit {
    /// The pixel has no value that could be shared out, or it is saturated or moved.
    NoValue,
    /// There is no surface at both sides in any direction.
    SurfacesUnknown,
    /// The surfaces at both sides are one.
    SameSurface,
    /// One of the surfaces has no significant share: the value lies on the other, or not between the two.
    OneSurface,
    /// The frequencies do not agree with two surfaces at these ranges: a third one, or multipath.
    NotExplained,
}

/// What became of the mixed pixels of a frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MixedPixels {
    /// Number of mixed pixels.
    pub pixels: usize,
    /// Those that were split, row by row.
    pub split: Vec<SplitPixel>,
    /// Those that were to be split and were not: column, row, reason; row by row.
    pub not_split: Vec<(usize, usize, NotSplit)>,
}

/// Drops, flags or splits the pixels that `mixed` says to see several surfaces.
///
/// `mixed` is what a detector of mixed pixels found (`true`: mixed). All of them get [`Flags::MIXED_PIXEL`]; by
/// [`MixedPixelTreatment::Drop`] also [`Flags::NO_DATA`] and NaN for range and sigma. No other pixel changes.
///
/// **Split.** Along row, column and diagonals the surfaces at both sides are continued to the pixel, by three to six pixels
/// straight in inverse range, to a foreground range `rf` and a background range `rb` with their standard deviations. Then
/// `z = a exp(i k rf) + b exp(i k rb)` shares the pixel out:
///
/// - with the complex `image` by least squares over all frequencies, in which `rf` and `rb` are observations too: chi-squared
///   says whether two surfaces explain the pixel, and the ranges get better;
/// - without, from the range alone: it must lie between the two.
///
/// Nothing is split that is not between two surfaces; [`MixedPixels::not_split`] gives the reasons.
pub fn treat_mixed_pixels(
    frame: &mut RangeFrame,
    mixed: &Raster<bool>,
    image: Option<&ComplexImage>,
    treatment: MixedPixelTreatment,
    options: &SplitOptions,
) -> Result<MixedPixels> {
    frame.validate()?;
    options.validate()?;
    frame.range.require_same_size(mixed, "mask of mixed pixels")?;
    let outcome = match treatment {
        MixedPixelTreatment::Split => split(frame, mixed, image, options)?,
        _ => MixedPixels::default(),
    };
    let marks = mixed.as_slice().iter().enumerate().filter(|(_, mixed)| **mixed);
    let mut pixels = 0;
    for (index, _) in marks {
        pixels += 1;
        frame.flags.as_mut_slice()[index] |= Flags::MIXED_PIXEL;
        if treatment == MixedPixelTreatment::Drop {
            frame.flags.as_mut_slice()[index] |= Flags::NO_DATA;
            frame.range.as_mut_slice()[index] = f32::NAN;
            frame.sigma.as_mut_slice()[index] = f32::NAN;
        }
    }
    Ok(MixedPixels { pixels, ..outcome })
}

/// What does not depend on the pixel.
struct Splitter<'a> {
    frame: &'a RangeFrame,
    finder: SurfaceFinder<'a>,
    complex: Option<(System, &'a ComplexFrame)>,
    /// Phase of one metre at level range; 0 for the limit of small phases.
    wavenumber: f64,
    /// Largest chi-squared of two surfaces, by degrees of freedom.
    thresholds: [f64; 2 * MAXIMUM_FREQUENCIES],
}

fn split(
    frame: &RangeFrame,
    mixed: &Raster<bool>,
    image: Option<&ComplexImage>,
    options: &SplitOptions,
) -> Result<MixedPixels> {
    let complex = image.map(|image| system(frame, image, &options.systematics)).transpose()?;
    let modulation = options.modulation_hz.map(Modulation::new).transpose()?;
    let SplitOptions { unknown_sigma_m, false_alarm, .. } = *options;
    let splitter = Splitter {
        frame,
        finder: SurfaceFinder { frame, mixed, unknown_sigma_m, floor_m: options.systematics.floor_m },
        complex,
        wavenumber: modulation.map_or(0.0, |modulation| modulation.phase_from_range(1.0)),
        thresholds: std::array::from_fn(|freedom| chi_squared_limit(freedom as f64, false_alarm)),
    };
    let width = frame.width().max(1);
    let rows = mixed.as_slice().par_chunks(width).enumerate();
    let rows: Vec<MixedPixels> = rows.map(|(row, mixed)| splitter.split_row(row, mixed)).collect();
    let mut outcome = MixedPixels::default();
    for row in rows {
        outcome.split.extend(row.split);
        outcome.not_split.extend(row.not_split);
    }
    Ok(outcome)
}

fn system<'a>(
    frame: &RangeFrame,
    image: &ComplexImage<'a>,
    systematics: &Systematics,
) -> Result<(System, &'a ComplexFrame)> {
    let modulations: Vec<Modulation> = image.frame.channels.iter().map(|channel| channel.modulation).collect();
    let system = System::new(&modulations, image.response, systematics, 1)?;
    system.require_frame(image.frame)?;
    frame.flags.require_same_size(&image.frame.flags, "complex image")?;
    Ok((system, image.frame))
}

impl Splitter<'_> {
    fn split_row(&self, row: usize, mixed: &[bool]) -> MixedPixels {
        let mut outcome = MixedPixels::default();
        let mut sides = Vec::new();
        for (col, _) in mixed.iter().enumerate().filter(|(_, mixed)| **mixed) {
            match self.split_pixel(col, row, &mut sides) {
                Ok(pixel) => outcome.split.push(pixel),
                Err(reason) => outcome.not_split.push((col, row, reason)),
            }
        }
        outcome
    }

    /// Tries the pairs of surfaces from the best known one; the reason is that of the first pair.
    fn split_pixel(&self, col: usize, row: usize, sides: &mut Vec<Sides>) -> std::result::Result<SplitPixel, NotSplit> {
        match self.finder.around(col, row, sides) {
            Around::Unknown => return Err(NotSplit::SurfacesUnknown),
            Around::Same => return Err(NotSplit::SameSurface),
            Around::Two => {}
        }
        let mut first = None;
        for sides in sides.iter() {
            match self.split_between(col, row, sides) {
                Ok(pixel) => return Ok(pixel),
                Err(reason) => first = first.or(Some(reason)),
            }
        }
        Err(first.unwrap_or(NotSplit::SurfacesUnknown))
    }

    fn split_between(&self, col: usize, row: usize, sides: &Sides) -> std::result::Result<SplitPixel, NotSplit> {
        let index = row * self.frame.width() + col;
        let at = |plane: &Raster<f32>| f64::from(plane.as_slice()[index]);
        let shared = if let Some((system, image)) = &self.complex {
            if image.flags.as_slice()[index].intersects(USELESS) {
                return Err(NotSplit::NoValue);
            }
            split_complex(&system.load(image, index, 0.0), sides, &self.thresholds)?
        } else {
            let sigma = at(&self.frame.sigma);
            let sigma = if sigma.is_finite() { sigma } else { self.finder.unknown_sigma_m };
            split_range(at(&self.frame.range), sigma, at(&self.frame.amplitude), self.wavenumber, sides)?
        };
        let weakest = shared.foreground.share.min(shared.background.share);
        if weakest < LEAST_SHARE_SIGMAS * shared.sigma_share {
            return Err(NotSplit::OneSurface);
        }
        Ok(SplitPixel { col, row, ..shared })
    }
}
