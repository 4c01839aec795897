//! What each term of a model did to a range: the correction taken apart, at one pixel and for a whole frame.

use range_image::{ImageFormat, Raster};

use crate::{FixedPattern, RangeErrorModel, Result};

/// A term of a model, as fine as a person asks for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum RangeTerm {
    /// Rangefinder offset d0.
    Offset,
    /// Drift of the warming camera, the same at all pixels (Sect. 4.7).
    WarmUp,
    /// d2 and d3, wavelength U.
    PeriodicU,
    /// d4 and d5, wavelength U/2.
    PeriodicHalfU,
    /// d6 and d7, wavelength U/4.
    PeriodicQuarterU,
    /// The periodic spline that stands instead of the sines.
    Spline,
    /// Signal propagation delay along x, e1.
    DelayX,
    /// Signal propagation delay along y, e2.
    DelayY,
    /// The surface over the image that stands instead of e1 and e2.
    Surface,
    /// Polynomial in range.
    Polynomial,
    /// Amplitude-related error, h1 to h3 (Eq. 15).
    Amplitude,
    /// The pixel's own offset from the table of the fixed pattern.
    Pattern,
}

impl RangeTerm {
    /// The term in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Offset => "offset d0",
            Self::WarmUp => "drift of the warming camera",
            Self::PeriodicU => "periodic, wavelength U (d2, d3)",
            Self::PeriodicHalfU => "periodic, wavelength U/2 (d4, d5)",
            Self::PeriodicQuarterU => "periodic, wavelength U/4 (d6, d7)",
            Self::Spline => "periodic spline",
            Self::DelayX => "signal delay along x (e1)",
            Self::DelayY => "signal delay along y (e2)",
            Self::Surface => "surface over the image",
            Self::Polynomial => "polynomial in range",
            Self::Amplitude => "amplitude (h1 to h3)",
            Self::Pattern => "fixed pattern of the pixel",
        }
    }

    /// The group of terms that it is pictured and summed up with.
    pub fn group(self) -> &'static str {
        match self {
            Self::Offset => "offset",
            Self::WarmUp => "warm-up",
            Self::PeriodicU | Self::PeriodicHalfU | Self::PeriodicQuarterU | Self::Spline => "periodic",
            Self::DelayX | Self::DelayY | Self::Surface => "position",
            Self::Polynomial => "polynomial",
            Self::Amplitude => "amplitude",
            Self::Pattern => "pattern",
        }
    }
}

/// What one term changed the range by: new range minus old range.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LedgerEntry {
    /// The term.
    pub term: RangeTerm,
    /// Change of the range, metre.
    pub change_m: f64,
}

/// What a model does not cover at a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum OutsideModel {
    /// The observed range: nothing was corrected.
    Range {
        /// Observed range, metre.
        range_m: f64,
        /// What the model was made for, metre.
        span_m: [f64; 2],
    },
    /// The amplitude, or it is NaN: the hyperbola was left out.
    Amplitude {
        /// Amplitude, camera's unit.
        amplitude: f64,
        /// What the hyperbola was fitted in.
        span: [f64; 2],
    },
    /// The hyperbola has no value at this amplitude of its span: it was left out.
    Radicand {
        /// Amplitude, camera's unit.
        amplitude: f64,
    },
    /// The image point: the surface counts with its value at the nearest edge.
    ImagePoint {
        /// From the principal point, millimetre.
        point_mm: [f64; 2],
    },
}

impl RangeErrorModel {
    /// The correction at an observed range (m), image point from the principal point (mm) and amplitude, term by term:
    /// one entry for each term that the model has and applies there, zero terms of Eq. 14 left out.
    ///
    /// `pattern_m` is the pixel's offset in the fixed pattern, where there is one. The sum of the changes is minus
    /// [`RangeCorrection::total_m`](crate::RangeCorrection::total_m) less `pattern_m`, to rounding. Outside the range span there is no entry; why a
    /// term is missing says [`Self::outside`].
    pub fn ledger(
        &self,
        range_m: f64,
        x_mm: f64,
        y_mm: f64,
        amplitude: f64,
        pattern_m: Option<f64>,
    ) -> Vec<LedgerEntry> {
        if !self.range_in_span(range_m) {
            return Vec::new();
        }
        let mut entries = Vec::new();
        let mut add = |term, correction_m: f64| entries.push(LedgerEntry { term, change_m: -correction_m });
        let mut add_used = |term, correction_m: f64, used: bool| {
            if used {
                add(term, correction_m);
            }
        };
        add_used(RangeTerm::Offset, self.terms.d0, self.terms.d0 != 0.0);
        if self.further.spline.is_some() {
            add_used(RangeTerm::Spline, self.by_range(range_m)[0].0, true);
        } else {
            let waves = self.terms.waves(self.ambiguity_interval_m, range_m);
            let terms = [RangeTerm::PeriodicU, RangeTerm::PeriodicHalfU, RangeTerm::PeriodicQuarterU];
            for ((term, wave), pair) in terms.into_iter().zip(waves).zip(self.terms.periodic.chunks_exact(2)) {
                add_used(term, wave, pair.iter().any(|d| *d != 0.0));
            }
        }
        if self.further.surface.is_some() {
            add_used(RangeTerm::Surface, self.by_position(x_mm, y_mm), true);
        } else {
            add_used(RangeTerm::DelayX, self.terms.e1 * x_mm, self.terms.e1 != 0.0);
            add_used(RangeTerm::DelayY, self.terms.e2 * y_mm, self.terms.e2 != 0.0);
        }
        add_used(RangeTerm::Polynomial, self.by_range(range_m)[1].0, self.further.polynomial.is_some());
        let (amplitude_m, left_out) = self.amplitude_correction(amplitude);
        add_used(RangeTerm::Amplitude, amplitude_m, self.hyperbola.is_some() && !left_out);
        add_used(RangeTerm::Pattern, pattern_m.unwrap_or(0.0), pattern_m.is_some());
        entries
    }

    /// What the model does not cover at a pixel; arguments as for [`Self::ledger`]. Empty where
    /// [`RangeCorrection::outside_span`](crate::RangeCorrection::outside_span) is not set.
    pub fn outside(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> Vec<OutsideModel> {
        if !self.range_in_span(range_m) {
            return vec![OutsideModel::Range { range_m, span_m: self.effective_range_span_m() }];
        }
        let mut reasons = Vec::new();
        if let Some(hyperbola) = self.hyperbola.filter(|hyperbola| hyperbola.correction(amplitude).is_none()) {
            let span = hyperbola.amplitude_span;
            reasons.push(if hyperbola.in_span(amplitude) {
                OutsideModel::Radicand { amplitude }
            } else {
                OutsideModel::Amplitude { amplitude, span }
            });
        }
        if self.further.surface.as_ref().is_some_and(|surface| !surface.in_span(x_mm, y_mm)) {
            reasons.push(OutsideModel::ImagePoint { point_mm: [x_mm, y_mm] });
        }
        reasons
    }
}

/// The change of each term over a whole frame of **observed** ranges, metre: one raster a term that acts on any pixel, in
/// the order of [`RangeTerm`]. Zero where a term was left out, NaN where there is no range.
///
/// `principal_point_mm` is (xp, yp). Refuses what [`correct_frame`](crate::correct_frame) refuses of model, pattern and
/// sizes.
pub fn ledger_maps(
    range: &Raster<f32>,
    amplitude: &Raster<f32>,
    model: &RangeErrorModel,
    format: &ImageFormat,
    principal_point_mm: [f64; 2],
    pattern: Option<&FixedPattern>,
) -> Result<Vec<(RangeTerm, Raster<f32>)>> {
    model.validate()?;
    maps(range, amplitude, format, principal_point_mm, pattern, |range_m, [x, y], amplitude, pattern_m| {
        model.ledger(range_m, x, y, amplitude, pattern_m)
    })
}

/// Maps of the entries that `ledger` has for range, image point from the principal point, amplitude and pattern.
pub(crate) fn maps(
    range: &Raster<f32>,
    amplitude: &Raster<f32>,
    format: &ImageFormat,
    principal_point_mm: [f64; 2],
    pattern: Option<&FixedPattern>,
    ledger: impl Fn(f64, [f64; 2], f64, Option<f64>) -> Vec<LedgerEntry>,
) -> Result<Vec<(RangeTerm, Raster<f32>)>> {
    format.validate()?;
    pattern.map_or(Ok(()), FixedPattern::validate)?;
    range.require_same_size(amplitude, "amplitude")?;
    let (width, height) = (format.width, format.height);
    range.require_same_size(&Raster::filled(width, height, ()), "image format")?;
    let no_change = || range.map(|range| if range.is_finite() { 0.0 } else { f32::NAN });
    let mut maps: Vec<(RangeTerm, Raster<f32>)> = Vec::new();
    for index in 0..range.len() {
        let (range_m, amplitude) = (range.as_slice()[index], amplitude.as_slice()[index]);
        let [x, y] = format.image_from_pixel([index % width, index / width].map(|place| place as f64));
        let (x, y) = (x - principal_point_mm[0], y - principal_point_mm[1]);
        let pattern_m = pattern.and_then(|pattern| pattern.offset_m.get(index)).map(|offset| f64::from(*offset));
        for entry in ledger(range_m.into(), [x, y], amplitude.into(), pattern_m) {
            let place = maps.iter().position(|(term, _)| *term == entry.term).unwrap_or_else(|| {
                maps.push((entry.term, no_change()));
                maps.len() - 1
            });
            maps[place].1.as_mut_slice()[index] = entry.change_m as f32;
        }
    }
    maps.sort_by_key(|(term, _)| *term);
    Ok(maps)
}
