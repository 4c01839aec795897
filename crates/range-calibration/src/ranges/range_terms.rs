//! Estimation of Eqs. 14 and 15 from range differences.

use adjust::{Adjustment, BlockId, Covariance, ParameterBlock, Solution, SolveOptions};
use error_models::{AmplitudeHyperbola, RangeErrorModel};

use crate::observed::hyperbola_start::hyperbola_start;
use crate::observed::options::{HyperbolaUse, LinearTerms};
use crate::ranges::hyperbola_real::{RealHyperbola, is_real_over_span};
use crate::ranges::observation::{DifferenceObservation, HyperbolaForm};
use crate::{Error, RangeCalibration, RangeDifference, RangeTermOptions, Result};

/// Estimates the range terms of one modulation frequency from range differences by least squares
/// (Sect. 5.3, two-step methods; laboratory calibration over known distances).
///
/// `ambiguity_interval_m` is U of the frequency. The terms are linear; with a hyperbola the adjustment starts from
/// the best of a coarse grid, goes on in numbers for which the hyperbola is real over the whole span of amplitudes
/// whatever they are, and ends undamped in h1, h2, h3.
///
/// # Errors
/// [`Error::NotDetermined`] where the differences cannot tell parameters apart, as with a wall at one distance only;
/// [`Error::TooFewDifferences`], [`Error::BadDifference`], [`Error::NothingToEstimate`], [`Error::NoHyperbola`];
/// [`Error::Model`] if the estimated terms are no usable model; [`Error::Adjust`] where the adjustment did not converge.
///
/// ```
/// use range_calibration::{RangeDifference, RangeTermOptions, Scale, estimate_range_terms};
///
/// // A target at 40 known distances over one interval of 5 m, at four places in the image; all ranges are 24 mm too long.
/// let difference = |k: usize| {
///     let reference_range_m = 0.5 + 0.11 * (k / 4) as f64;
///     let [x_mm, y_mm] = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]][k % 4];
///     let observed_range_m = reference_range_m + 0.024;
///     RangeDifference { observed_range_m, reference_range_m, x_mm, y_mm, amplitude: f64::NAN, sigma_m: 0.002 }
/// };
/// let differences: Vec<RangeDifference> = (0..160).map(difference).collect();
/// let found = estimate_range_terms(&differences, 5.0, &RangeTermOptions::default())?;
/// assert!((found.model().terms.d0 - 0.024).abs() < 1e-9);
/// assert!(found.parameters(Scale::Prior)?[0].sigma < 0.001);
/// # Ok::<(), range_calibration::Error>(())
/// ```
pub fn estimate_range_terms(
    differences: &[RangeDifference],
    ambiguity_interval_m: f64,
    options: &RangeTermOptions,
) -> Result<RangeCalibration> {
    let problem = Problem::new(differences, ambiguity_interval_m, options)?;
    let start = problem.start_of_hyperbola()?;
    let (solution, blocks) = problem.solve_from(start)?;
    let diagnosis = solution.diagnosis(1.0);
    if diagnosis.weakest_inflation > options.largest_inflation {
        return Err(problem.not_determined(diagnosis.weakest.to_string(), diagnosis.weakest_inflation));
    }
    let model = problem.model(&solution, &blocks)?;
    let rms = |sum: f64| (sum / differences.len() as f64).sqrt();
    let before = differences.iter().map(|d| (d.observed_range_m - d.reference_range_m).powi(2)).sum();
    let after = solution.residuals().iter().map(|v| v * v).sum();
    Ok(RangeCalibration { model, solution, rms_before_m: rms(before), rms_after_m: rms(after) })
}

/// The checked input of an estimation.
struct Problem<'a> {
    differences: &'a [RangeDifference],
    options: &'a RangeTermOptions,
    terms: LinearTerms,
    /// Design rows of all differences, one behind the other.
    rows: Vec<f64>,
    range_span_m: [f64; 2],
    amplitude_span: [f64; 2],
}

impl<'a> Problem<'a> {
    fn new(
        differences: &'a [RangeDifference],
        ambiguity_interval_m: f64,
        options: &'a RangeTermOptions,
    ) -> Result<Self> {
        options.validate()?;
        if !(ambiguity_interval_m.is_finite() && ambiguity_interval_m > 0.0) {
            return Err(Error::OutOfDomain {
                name: "ambiguity_interval_m",
                value: ambiguity_interval_m,
                expected: "an ambiguity interval is positive and finite",
            });
        }
        differences.iter().enumerate().try_for_each(|(index, difference)| check_difference(difference, index))?;
        let terms = LinearTerms::new(options, ambiguity_interval_m)?;
        let unknowns = terms.unknowns() + if options.hyperbola == HyperbolaUse::Estimate { 3 } else { 0 };
        if unknowns == 0 {
            return Err(Error::NothingToEstimate);
        }
        if differences.len() <= unknowns {
            return Err(Error::TooFewDifferences { differences: differences.len(), unknowns });
        }
        let range_span_m = span(differences.iter().map(|d| d.observed_range_m));
        let amplitude_span = match options.hyperbola {
            HyperbolaUse::Hold(hyperbola) => hyperbola.amplitude_span,
            _ => span(differences.iter().map(|d| d.amplitude)),
        };
        let rows = design_rows(differences, &terms.model)?;
        let problem = Self { differences, options, terms, rows, range_span_m, amplitude_span };
        problem.require_amplitudes()?;
        Ok(problem)
    }

    /// Refuses amplitudes that the hyperbola cannot have a value at.
    fn require_amplitudes(&self) -> Result<()> {
        if self.options.hyperbola == HyperbolaUse::None {
            return Ok(());
        }
        let [low, high] = self.amplitude_span;
        for (index, difference) in self.differences.iter().enumerate() {
            let value = difference.amplitude;
            if !(value >= low && value <= high && value.is_finite() && value >= 0.0) {
                let expected = "an amplitude that the hyperbola covers";
                return Err(Error::BadDifference { index, name: "amplitude", value, expected });
            }
        }
        Ok(())
    }

    /// Coefficients the hyperbola starts from or is held at; `None` without one.
    fn start_of_hyperbola(&self) -> Result<Option<[f64; 3]>> {
        match self.options.hyperbola {
            HyperbolaUse::None => Ok(None),
            HyperbolaUse::Hold(hyperbola) => Ok(Some([hyperbola.h1, hyperbola.h2, hyperbola.h3])),
            HyperbolaUse::Estimate => {
                let residuals = self.residuals_of_terms_alone()?;
                let amplitudes = self.differences.iter().map(|d| d.amplitude);
                let mut samples: Vec<_> = amplitudes.zip(residuals).collect();
                hyperbola_start(&mut samples, self.amplitude_span).map(Some)
            }
        }
    }

    /// What the terms leave over without any hyperbola. The offset's share is added again: it is told from the
    /// level of the hyperbola only together with it.
    fn residuals_of_terms_alone(&self) -> Result<Vec<f64>> {
        if self.terms.unknowns() == 0 {
            let held = self.terms.model.parameter_values();
            let modelled = self.rows().map(|row| row.iter().zip(&held).map(|(d, value)| d * value).sum::<f64>());
            return Ok(self.observed().zip(modelled).map(|(observed, modelled)| observed - modelled).collect());
        }
        let (solution, blocks) = self.solve(None, self.coefficients())?;
        let offset = solution.values(blocks[0])?[0];
        let free = if self.terms.held[0] { 0.0 } else { offset };
        Ok(solution.residuals().iter().map(|v| v + free).collect())
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.rows.chunks_exact(self.terms.model.parameter_count())
    }

    /// Observed minus reference ranges, metre.
    fn observed(&self) -> impl Iterator<Item = f64> + '_ {
        self.differences.iter().map(|d| d.observed_range_m - d.reference_range_m)
    }

    fn coefficients(&self) -> HyperbolaForm {
        HyperbolaForm::Coefficients(self.amplitude_span)
    }

    /// Adjusts from a start of the hyperbola, where there is one: if it is estimated, first where it cannot but be real.
    fn solve_from(&self, start: Option<[f64; 3]>) -> Result<(Solution, Vec<BlockId>)> {
        let Some(start) = start.filter(|_| self.options.hyperbola == HyperbolaUse::Estimate) else {
            return self.solve(start, self.coefficients());
        };
        let lowest = self.amplitude_span[0];
        let real = RealHyperbola::near(start, lowest).and_then(|near| {
            let (solution, blocks) = self.solve(Some(near.logarithms()), HyperbolaForm::Real(lowest)).ok()?;
            RealHyperbola::from_logarithms(solution.values(blocks[1]).ok()?, lowest)
        });
        let refused = Error::NoHyperbola {
            reason: "the residuals ask for one that has no real value at the smallest amplitudes, or for none at all; \
                     leave it out, or give more differences at small amplitudes",
        };
        let (solution, blocks) =
            match self.solve(Some(real.map_or(start, |real| real.coefficients())), self.coefficients()) {
                Err(Error::Adjust(_)) => return Err(refused),
                other => other?,
            };
        let found = self.model_of(&solution, &blocks)?.hyperbola;
        if found.is_some_and(|hyperbola| !is_real_over_span(&hyperbola)) {
            return Err(refused);
        }
        Ok((solution, blocks))
    }

    /// Adjusts the terms, and the hyperbola where there is one. The first block holds the terms.
    fn solve(&self, hyperbola: Option<[f64; 3]>, form: HyperbolaForm) -> Result<(Solution, Vec<BlockId>)> {
        let mut adjustment = Adjustment::new();
        let mut blocks = vec![adjustment.add_block(self.terms.block())];
        self.terms.hold(&mut adjustment, blocks[0])?;
        if let Some(start) = hyperbola {
            let block = ParameterBlock::euclidean(start).named("hyperbola");
            blocks.push(adjustment.add_block(block.with_parameter_names(AmplitudeHyperbola::NAMES)));
            if self.options.hyperbola != HyperbolaUse::Estimate {
                adjustment.hold(blocks[1])?;
            }
        }
        let group = adjustment.add_group("range differences");
        for ((difference, difference_m), row) in self.differences.iter().zip(self.observed()).zip(self.rows()) {
            let (blocks, amplitude) = (blocks.clone(), difference.amplitude);
            let observation = DifferenceObservation { blocks, difference_m, amplitude, row, form };
            adjustment.add_observation(group, observation, &Covariance::from_sigma(difference.sigma_m))?;
        }
        match adjustment.solve(&SolveOptions::default()) {
            Ok(solution) => Ok((solution, blocks)),
            Err(adjust::Error::RankDeficient { combinations, .. }) => {
                let names: Vec<String> = combinations.iter().map(ToString::to_string).collect();
                Err(self.not_determined(names.join("; "), f64::INFINITY))
            }
            Err(error) => Err(error.into()),
        }
    }

    fn not_determined(&self, combination: String, inflation: f64) -> Error {
        Error::NotDetermined { combination, inflation, range_span_m: self.range_span_m }
    }

    fn model(&self, solution: &Solution, blocks: &[BlockId]) -> Result<RangeErrorModel> {
        let model = self.model_of(solution, blocks)?;
        model.validate()?;
        Ok(model)
    }

    fn model_of(&self, solution: &Solution, blocks: &[BlockId]) -> Result<RangeErrorModel> {
        let mut model = self.terms.model.clone();
        model.set_parameter_values(solution.values(blocks[0])?)?;
        model.hyperbola = match blocks.get(1).map(|block| solution.values(*block)).transpose()? {
            Some(&[h1, h2, h3]) => Some(AmplitudeHyperbola { h1, h2, h3, amplitude_span: self.amplitude_span }),
            _ => None,
        };
        model.range_span_m = Some(self.range_span_m);
        Ok(model)
    }
}

/// Design rows of all differences, one behind the other; refuses a difference that a polynomial or a surface does not
/// reach.
pub(crate) fn design_rows(differences: &[RangeDifference], model: &RangeErrorModel) -> Result<Vec<f64>> {
    let mut rows = vec![0.0; differences.len() * model.parameter_count()];
    for ((index, d), row) in differences.iter().enumerate().zip(rows.chunks_exact_mut(model.parameter_count())) {
        let bad = |name, value, expected| Err(Error::BadDifference { index, name, value, expected });
        if !model.range_in_span(d.observed_range_m) {
            return bad("observed_range_m", d.observed_range_m, "a range in the span of the polynomial");
        }
        if model.further.surface.as_ref().is_some_and(|surface| !surface.in_span(d.x_mm, d.y_mm)) {
            return bad("x_mm", d.x_mm, "an image point in the spans of the surface, y as well");
        }
        model.design_row_into(d.observed_range_m, d.x_mm, d.y_mm, row)?;
    }
    Ok(rows)
}

/// Smallest and largest of some values; NaN is passed over.
pub(crate) fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Refuses a difference that is no number or has no standard deviation.
pub(crate) fn check_difference(difference: &RangeDifference, index: usize) -> Result<()> {
    let named = [
        ("observed_range_m", difference.observed_range_m),
        ("reference_range_m", difference.reference_range_m),
        ("x_mm", difference.x_mm),
        ("y_mm", difference.y_mm),
    ];
    let bad = |name, value, expected| Err(Error::BadDifference { index, name, value, expected });
    for (name, value) in named {
        if !value.is_finite() {
            return bad(name, value, "a finite number");
        }
    }
    if difference.sigma_m > 0.0 && difference.sigma_m.is_finite() {
        return Ok(());
    }
    bad("sigma_m", difference.sigma_m, "a positive, finite standard deviation")
}
