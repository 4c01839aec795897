//! Range-error models between two integration times (Sect. 4.6).

use range_image::{ImageFormat, RangeFrame, Raster};

use crate::{
    CorrectionSummary, Error, FixedPattern, GroupChange, LedgerEntry, ModelSet, OutsideModel, RangeCorrection,
    RangeErrorModel, RangeTerm, Result, correct_frame, ledger,
};

/// The range errors at an integration time between two that models were made for.
///
/// `Δρ = (1 − w) Δρ_shorter + w Δρ_longer` at the same range, image point and amplitude, w linear in the logarithm of the
/// integration time. For the terms that `Δρ` is linear in this is the interpolation of their coefficients. For the
/// hyperbola (Eq. 15) it is that of its values: with interpolated h1, h2, h3 the radicand could become negative between
/// two times at which it is positive everywhere, the mean of two real values cannot. The result holds for the ranges and
/// amplitudes that both models hold for.
#[derive(Debug, Clone, PartialEq)]
pub struct InterpolatedModel {
    pub(crate) shorter: RangeErrorModel,
    /// With its weight; `None` at a time that has a model of its own.
    pub(crate) longer: Option<(RangeErrorModel, f64)>,
    /// Added to d0 of both; apart from it, so that a ledger can tell the two.
    pub(crate) drift_m: f64,
}

impl From<RangeErrorModel> for InterpolatedModel {
    fn from(model: RangeErrorModel) -> Self {
        Self { shorter: model, longer: None, drift_m: 0.0 }
    }
}

impl ModelSet {
    /// The models at an integration time, one per modulation frequency: those of that time, or between its neighbours.
    ///
    /// # Errors
    /// [`Error::NoModelForIntegrationTime`] outside the times there are: nothing is extrapolated.
    /// [`Error::DifferentKinds`], [`Error::NoCommonSpan`] and [`Error::OutOfDomain`] (another modulation frequency, a
    /// hyperbola without a real value inside its span) where there is nothing between two neighbours.
    pub fn at(&self, integration_time_s: f64) -> Result<Vec<InterpolatedModel>> {
        let refusal = match self.select(integration_time_s) {
            Ok(models) => return Ok(models.iter().cloned().map(InterpolatedModel::from).collect()),
            Err(refusal) => refusal,
        };
        self.validate()?;
        let between =
            |pair: &&[(f64, Vec<RangeErrorModel>)]| pair[0].0 < integration_time_s && integration_time_s < pair[1].0;
        let Some([(shorter_s, shorter), (longer_s, longer)]) = self.entries.windows(2).find(between) else {
            return Err(refusal);
        };
        let weight = (integration_time_s / shorter_s).ln() / (longer_s / shorter_s).ln();
        let pairs = shorter.iter().zip(longer);
        pairs.map(|(a, b)| InterpolatedModel::between([a, b], [*shorter_s, *longer_s], weight)).collect()
    }
}

impl InterpolatedModel {
    fn between(models: [&RangeErrorModel; 2], [shorter_s, longer_s]: [f64; 2], weight: f64) -> Result<Self> {
        let [mut shorter, mut longer] = models.map(Clone::clone);
        let (interval, other) = (shorter.ambiguity_interval_m, longer.ambiguity_interval_m);
        if (interval - other).abs() > 1e-9 * interval {
            let expected = "all integration times have models of the same modulation frequencies";
            return Err(Error::OutOfDomain { name: "ambiguity_interval_m", value: other, expected });
        }
        let kinds = models.map(|model| {
            let further = &model.further;
            [
                ("hyperbola", model.hyperbola.is_some()),
                ("spline", further.spline.is_some()),
                ("polynomial", further.polynomial.is_some()),
                ("surface", further.surface.is_some()),
            ]
        });
        if let Some(((term, _), _)) = kinds[0].iter().zip(&kinds[1]).find(|(a, b)| a != b) {
            return Err(Error::DifferentKinds { shorter_s, longer_s, term });
        }
        let common = |[a, b]: [[f64; 2]; 2], span| {
            let both = [a[0].max(b[0]), a[1].min(b[1])];
            if both[0] < both[1] { Ok(both) } else { Err(Error::NoCommonSpan { shorter_s, longer_s, span }) }
        };
        let range_span_m = common(models.map(RangeErrorModel::effective_range_span_m), "ranges")?;
        for model in [&mut shorter, &mut longer] {
            model.range_span_m = Some(range_span_m);
        }
        if let (Some(a), Some(b)) = (&mut shorter.hyperbola, &mut longer.hyperbola) {
            let span = common([a.amplitude_span, b.amplitude_span], "amplitudes")?;
            for hyperbola in [a, b] {
                hyperbola.amplitude_span = span;
                let value = hyperbola.least_radicand();
                if value < 0.0 {
                    let expected = "Eq. 15 has a real value at all amplitudes that both integration times have";
                    return Err(Error::OutOfDomain { name: "radicand of the hyperbola", value, expected });
                }
            }
        }
        Ok(Self { shorter, longer: Some((longer, weight)), drift_m: 0.0 })
    }

    /// Adds to d0, metre: the drift of a warming camera, which a ledger tells from d0 as [`RangeTerm::WarmUp`].
    pub fn add_offset(&mut self, offset_m: f64) {
        self.drift_m += offset_m;
    }

    /// One of the two with the drift in its d0.
    fn drifted(&self, model: &RangeErrorModel) -> RangeErrorModel {
        let mut model = model.clone();
        model.terms.d0 += self.drift_m;
        model
    }

    /// The correction at one pixel; arguments and behaviour outside the spans as for [`RangeErrorModel::correction`].
    pub fn correction(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> RangeCorrection {
        let of = |model: &RangeErrorModel| {
            let found = model.correction(range_m, x_mm, y_mm, amplitude);
            let drift_m = if model.range_in_span(range_m) { self.drift_m } else { 0.0 };
            RangeCorrection { offset_m: found.offset_m + drift_m, ..found }
        };
        let a = of(&self.shorter);
        let Some((longer, weight)) = &self.longer else { return a };
        let b = of(longer);
        let mean = |a: f64, b: f64| blend(a, b, *weight);
        RangeCorrection {
            offset_m: mean(a.offset_m, b.offset_m),
            periodic_m: mean(a.periodic_m, b.periodic_m),
            delay_m: mean(a.delay_m, b.delay_m),
            polynomial_m: mean(a.polynomial_m, b.polynomial_m),
            amplitude_m: mean(a.amplitude_m, b.amplitude_m),
            range_derivative: mean(a.range_derivative, b.range_derivative),
            outside_span: a.outside_span || b.outside_span,
        }
    }

    /// The correction at one pixel term by term, as [`RangeErrorModel::ledger`] gives it.
    pub fn ledger(
        &self,
        range_m: f64,
        x_mm: f64,
        y_mm: f64,
        amplitude: f64,
        pattern_m: Option<f64>,
    ) -> Vec<LedgerEntry> {
        let of = |model: &RangeErrorModel| model.ledger(range_m, x_mm, y_mm, amplitude, pattern_m);
        let mut entries = of(&self.shorter);
        if let Some((longer, weight)) = &self.longer {
            for entry in &mut entries {
                entry.change_m *= 1.0 - weight;
            }
            for other in of(longer) {
                let change_m = weight * other.change_m;
                match entries.iter_mut().find(|entry| entry.term == other.term) {
                    Some(entry) => entry.change_m += change_m,
                    None => entries.push(LedgerEntry { change_m, ..other }),
                }
            }
        }
        if self.drift_m != 0.0 && self.shorter.range_in_span(range_m) {
            entries.push(LedgerEntry { term: RangeTerm::WarmUp, change_m: -self.drift_m });
        }
        entries.sort_by_key(|entry| entry.term);
        entries
    }

    /// What either model does not cover at a pixel; see [`RangeErrorModel::outside`].
    pub fn outside(&self, range_m: f64, x_mm: f64, y_mm: f64, amplitude: f64) -> Vec<OutsideModel> {
        let mut reasons = self.shorter.outside(range_m, x_mm, y_mm, amplitude);
        if let Some((longer, _)) = &self.longer {
            let others = longer.outside(range_m, x_mm, y_mm, amplitude);
            let new: Vec<OutsideModel> = others.into_iter().filter(|reason| !reasons.contains(reason)).collect();
            reasons.extend(new);
        }
        reasons
    }

    /// The change of each term over a frame; see [`ledger_maps`](crate::ledger_maps) and [`Self::ledger`].
    pub fn ledger_maps(
        &self,
        range: &Raster<f32>,
        amplitude: &Raster<f32>,
        format: &ImageFormat,
        principal_point_mm: [f64; 2],
        pattern: Option<&FixedPattern>,
    ) -> Result<Vec<(RangeTerm, Raster<f32>)>> {
        self.shorter.validate()?;
        ledger::maps(range, amplitude, format, principal_point_mm, pattern, |range_m, [x, y], amplitude, pattern_m| {
            self.ledger(range_m, x, y, amplitude, pattern_m)
        })
    }

    /// Takes the range errors and the pattern off a frame, in place, as [`correct_frame`] does.
    ///
    /// The largest changes of the summary are bounds where two models are blended: the weighted means of the largest
    /// changes of both.
    pub fn correct_frame(
        &self,
        frame: &mut RangeFrame,
        format: &ImageFormat,
        principal_point_mm: [f64; 2],
        pattern: Option<&FixedPattern>,
    ) -> Result<CorrectionSummary> {
        let Some((longer, weight)) = &self.longer else {
            return correct_frame(frame, &self.drifted(&self.shorter), format, principal_point_mm, pattern);
        };
        self.shorter.validate()?;
        // What both say of each pixel is linear in Δρ, and so is its blend: the loops need not know of two models.
        let mut other = frame.clone();
        let of_longer = correct_frame(&mut other, &self.drifted(longer), format, principal_point_mm, pattern)?;
        let of_shorter = correct_frame(frame, &self.drifted(&self.shorter), format, principal_point_mm, pattern)?;
        for (range, other) in frame.range.as_mut_slice().iter_mut().zip(other.range.as_slice()) {
            *range = blend(f64::from(*range), f64::from(*other), *weight) as f32;
        }
        // Each is |1 − ∂Δρ/∂ρ| σ, and no derivative reaches 1.
        for (sigma, other) in frame.sigma.as_mut_slice().iter_mut().zip(other.sigma.as_slice()) {
            *sigma = blend(f64::from(*sigma), f64::from(*other), *weight) as f32;
        }
        let flags = frame.flags.as_mut_slice().iter_mut().zip(other.flags.as_slice());
        let mut outside_span = 0;
        for (flags, other) in flags {
            flags.insert(*other);
            outside_span += usize::from(flags.contains(range_image::Flags::OUTSIDE_SPAN));
        }
        let change = |group: fn(&CorrectionSummary) -> GroupChange| {
            let (a, b) = (group(&of_shorter), group(&of_longer));
            GroupChange {
                mean_m: blend(a.mean_m, b.mean_m, *weight),
                largest_m: blend(a.largest_m, b.largest_m, *weight),
            }
        };
        Ok(CorrectionSummary {
            outside_span: outside_span.min(of_shorter.outside_span + of_longer.outside_span),
            total: change(|s| s.total),
            offset: change(|s| s.offset),
            periodic: change(|s| s.periodic),
            delay: change(|s| s.delay),
            polynomial: change(|s| s.polynomial),
            amplitude: change(|s| s.amplitude),
            pattern: change(|s| s.pattern),
            ..of_shorter
        })
    }
}

pub(crate) fn blend(a: f64, b: f64, weight: f64) -> f64 {
    (1.0 - weight) * a + weight * b
}
