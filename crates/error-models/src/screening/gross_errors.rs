//! Flagging measurements that fit no surface: mixed pixels and pixels with too little light.

use range_image::{Flags, RangeFrame};
use rayon::prelude::*;

use crate::screening::mixed_pixels::MixedPixelTest;
use crate::{Error, Result};

/// What [`flag_gross_errors`] looks for.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct GrossErrorOptions {
    /// How mixed pixels are told from surfaces; `None` leaves them alone. Default: that of [`MixedPixelOptions`].
    pub mixed_pixels: Option<MixedPixelOptions>,
    /// Pixels of a smaller amplitude (camera's unit) are flagged; `None`, the default, flags none. A reasoned value
    /// gives [`lowest_amplitude`](crate::lowest_amplitude).
    pub low_amplitude: Option<f64>,
}

impl Default for GrossErrorOptions {
    /// Mixed pixels by their default; no amplitude threshold, as its unit is the camera's own.
    fn default() -> Self {
        Self { mixed_pixels: Some(MixedPixelOptions::default()), low_amplitude: None }
    }
}

/// How far a pixel must be from the surfaces at both sides to count as mixed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct MixedPixelOptions {
    /// Distance in standard deviations of the difference between the pixel and the continued surface: of the noise of
    /// all pixels that take part, and of the floor. Default: 4.
    pub sigmas: f64,
    /// Standard deviation, metre, of what is no noise: what scattered light and calibration leave, and grain of
    /// surfaces. Default: 0.005 m.
    pub floor_m: f64,
    /// Standard deviation of a range where the frame gives none, metre. Default: 0.005 m.
    pub unknown_sigma_m: f64,
    /// Ambiguity interval of the modulation whose amplitudes the frame holds, metre: light of two surfaces adds up by its phases.
    /// Default: `None`, phases count as alike, which takes edges of steps above a tenth of the interval for narrow surfaces.
    pub ambiguity_interval_m: Option<f64>,
}

impl Default for MixedPixelOptions {
    /// Four standard deviations, with a floor of 5 mm; 5 mm of noise where sigma is not known.
    fn default() -> Self {
        Self { sigmas: 4.0, floor_m: 0.005, unknown_sigma_m: 0.005, ambiguity_interval_m: None }
    }
}

/// Number of pixels that one call of [`flag_gross_errors`] found, flagged before or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FlagCounts {
    /// Pixels flagged [`Flags::MIXED_PIXEL`].
    pub mixed_pixel: usize,
    /// Pixels flagged [`Flags::LOW_AMPLITUDE`].
    pub low_amplitude: usize,
}

/// Flags mixed pixels (the spikes and flying points at edges) and pixels of low amplitude; ranges stay as they
/// are.
///
/// Along a row, a column and both diagonals the surfaces at both sides of a pixel are continued to it, by two
/// pixels each, straight in `1/ρ` - which is what a plane is along a line of pixels, whatever the angle of
/// incidence. A pixel is **mixed** if its range lies between the two continued surfaces and further from both than
/// the threshold of [`MixedPixelOptions`], if neither neighbour has its range, and if no block of 3 by 3 pixels with it
/// at a corner is a plane but for noise and the floor (chi-squared at the 0.1 % level). So a tilted wall continues itself, the pixels
/// beside a sharp edge continue their own side, on a curved surface both sides err to the same side of the pixel, and a
/// surface four pixels wide is one whatever stands around it. So is a narrower one that is long: a line of seven pixels
/// through it is straight but for noise and the floor (1 % level), it is further from both others than three times the threshold,
/// and its light is not what a mixture of them would return (with the ambiguity interval, by its phasors). Edges up to three mixed pixels wide are seen where they are
/// not as straight as a surface. Not seen: a pixel mixed of three surfaces that does not lie between two of them, pixels at
/// surfaces so narrow that nothing tells their tilt (stairs from afar), a pixel with a single one between it and the image's
/// rim, and a structure of a single pixel in front of all others. A real surface that is narrow, short and between two
/// others cannot be told from mixed pixels and is flagged, and without amplitudes one that is long, too.
///
/// A NaN amplitude is not low. Refuses planes of different sizes and options that are not finite or negative.
///
/// ```
/// use error_models::range_image::{Flags, RangeFrame, Raster};
/// use error_models::{GrossErrorOptions, flag_gross_errors};
///
/// // A board at 2 m before a wall at 4 m; the column between sees both.
/// let range = Raster::from_fn(20, 20, |col, _row| [2.0, 3.1, 4.0][usize::from(col > 8) + usize::from(col > 9)]);
/// let mut frame = RangeFrame { sigma: Raster::filled(20, 20, 0.01), ..RangeFrame::from_range(range) };
/// let counts = flag_gross_errors(&mut frame, &GrossErrorOptions::default())?;
/// assert!(counts.mixed_pixel > 10 && frame.flags[(9, 10)].contains(Flags::MIXED_PIXEL));
/// # Ok::<(), error_models::Error>(())
/// ```
pub fn flag_gross_errors(frame: &mut RangeFrame, options: &GrossErrorOptions) -> Result<FlagCounts> {
    frame.validate()?;
    options.validate()?;
    let width = frame.width().max(1);
    let planes = [&frame.range, &frame.sigma, &frame.amplitude];
    let test = options.mixed_pixels.map(|options| MixedPixelTest::new(planes, options));
    let threshold = options.low_amplitude.map_or(f32::NEG_INFINITY, |amplitude| amplitude as f32);
    let rows = frame.flags.as_mut_slice().par_chunks_mut(width).zip(frame.amplitude.as_slice().par_chunks(width));
    let counts = rows.enumerate().map(|(row, (flags, amplitudes))| {
        let mut counts = FlagCounts::default();
        for (col, (flags, amplitude)) in flags.iter_mut().zip(amplitudes).enumerate() {
            if *amplitude < threshold {
                *flags |= Flags::LOW_AMPLITUDE;
                counts.low_amplitude += 1;
            }
            if test.as_ref().is_some_and(|test| test.is_mixed(col, row)) {
                *flags |= Flags::MIXED_PIXEL;
                counts.mixed_pixel += 1;
            }
        }
        counts
    });
    Ok(counts.reduce(FlagCounts::default, |a, b| FlagCounts {
        mixed_pixel: a.mixed_pixel + b.mixed_pixel,
        low_amplitude: a.low_amplitude + b.low_amplitude,
    }))
}

impl GrossErrorOptions {
    /// Refuses thresholds that are not finite, and mixed-pixel thresholds that are negative or both zero.
    pub fn validate(&self) -> Result<()> {
        self.low_amplitude.map_or(Ok(()), |value| crate::error::require_finite("low_amplitude", value))?;
        let Some(mixed) = self.mixed_pixels else { return Ok(()) };
        let named = [("sigmas", mixed.sigmas), ("floor_m", mixed.floor_m), ("unknown_sigma_m", mixed.unknown_sigma_m)];
        for (name, value) in named {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::OutOfDomain { name, value, expected: "a threshold is finite and not negative" });
            }
        }
        if let Some(value) = mixed.ambiguity_interval_m.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(Error::OutOfDomain { name: "ambiguity_interval_m", value, expected: "finite and above zero" });
        }
        if mixed.sigmas * (mixed.floor_m + mixed.unknown_sigma_m) > 0.0 {
            return Ok(());
        }
        Err(Error::OutOfDomain {
            name: "sigmas",
            value: mixed.sigmas,
            expected: "sigmas above zero, and floor_m or unknown_sigma_m above zero",
        })
    }
}
