//! Estimation of Eqs. 14 and 15 from range differences.

use adjust::{Adjustment, BlockId, Covariance, ParameterBlock, Solution, SolveOptions};
use error_models::{AmplitudeHyperbola, RangeErrorModel, RangeTerms};

use crate::hyperbola_start::hyperbola_start;
use crate::observation::DifferenceObservation;
use crate::options::{HyperbolaUse, TermUse};
use crate::{Error, RangeCalibration, RangeDifference, RangeTermOptions, Result};

/// Estimates the range terms of one modulation frequency from range differences by least squares
/// (Sect. 5.3, two-step methods; laboratory calibration over known distances).
///
/// `ambiguity_interval_m` is U of the frequency. The terms are linear; with a hyperbola the adjustment starts from
/// the best of a coarse grid and ends undamped.
///
/// # Errors
/// [`Error::NotDetermined`] where the differences cannot tell parameters apart, as with a wall at one distance only;
/// [`Error::TooFewDifferences`], [`Error::BadDifference`], [`Error::NothingToEstimate`], [`Error::NoHyperbola`];
/// [`Error::Model`] if the estimated terms are no usable model; [`Error::Adjust`] where the adjustment did not converge.
pub fn estimate_range_terms(
    differences: &[RangeDifference],
    ambiguity_interval_m: f64,
    options: &RangeTermOptions,
) -> Result<RangeCalibration> {
    let problem = Problem::new(differences, ambiguity_interval_m, options)?;
    let start = problem.start_of_hyperbola()?;
    let (solution, blocks) = problem.solve(start)?;
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
    ambiguity_interval_m: f64,
    options: &'a RangeTermOptions,
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
        differences.iter().enumerate().try_for_each(|(index, difference)| difference.validate(index))?;
        let unknowns = options.unknowns();
        if differences.len() <= unknowns {
            return Err(Error::TooFewDifferences { differences: differences.len(), unknowns });
        }
        let range_span_m = span(differences.iter().map(|d| d.observed_range_m));
        let amplitude_span = match options.hyperbola {
            HyperbolaUse::Hold(hyperbola) => hyperbola.amplitude_span,
            _ => span(differences.iter().map(|d| d.amplitude)),
        };
        let problem = Self { differences, ambiguity_interval_m, options, range_span_m, amplitude_span };
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
        let terms_alone = RangeTermOptions { hyperbola: HyperbolaUse::None, ..*self.options };
        let alone = Problem { options: &terms_alone, ..*self };
        if terms_alone.unknowns() == 0 {
            let start = RangeTerms::from_array(self.options.start());
            let left = |d: &RangeDifference| {
                let modelled = start.correction(self.ambiguity_interval_m, d.observed_range_m, d.x_mm, d.y_mm);
                d.observed_range_m - d.reference_range_m - modelled
            };
            return Ok(self.differences.iter().map(left).collect());
        }
        let (solution, blocks) = alone.solve(None)?;
        let offset = solution.values(blocks[0])?[0];
        let free = if self.options.terms[0] == TermUse::Estimate { offset } else { 0.0 };
        Ok(solution.residuals().iter().map(|v| v + free).collect())
    }

    /// Adjusts the terms, and the hyperbola where there is one. The first block holds the terms.
    fn solve(&self, hyperbola: Option<[f64; 3]>) -> Result<(Solution, Vec<BlockId>)> {
        let mut adjustment = Adjustment::new();
        let terms = ParameterBlock::euclidean(self.options.start()).named("terms");
        let mut blocks = vec![adjustment.add_block(terms.with_parameter_names(RangeTerms::NAMES))];
        for (component, term) in self.options.terms.iter().enumerate() {
            if matches!(term, TermUse::Hold(_)) {
                adjustment.hold_parameter(blocks[0], component)?;
            }
        }
        if let Some(start) = hyperbola {
            let block = ParameterBlock::euclidean(start).named("hyperbola");
            blocks.push(adjustment.add_block(block.with_parameter_names(AmplitudeHyperbola::NAMES)));
            if self.options.hyperbola != HyperbolaUse::Estimate {
                adjustment.hold(blocks[1])?;
            }
        }
        let group = adjustment.add_group("range differences");
        for difference in self.differences {
            let observation = DifferenceObservation {
                blocks: blocks.clone(),
                difference: *difference,
                ambiguity_interval_m: self.ambiguity_interval_m,
                amplitude_span: self.amplitude_span,
            };
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
        let mut terms = [0.0; 9];
        terms.copy_from_slice(solution.values(blocks[0])?);
        let hyperbola = match blocks.get(1).map(|block| solution.values(*block)).transpose()? {
            Some(&[h1, h2, h3]) => Some(AmplitudeHyperbola { h1, h2, h3, amplitude_span: self.amplitude_span }),
            _ => None,
        };
        let model = RangeErrorModel {
            terms: RangeTerms::from_array(terms),
            hyperbola,
            range_span_m: Some(self.range_span_m),
            ..RangeErrorModel::error_free(self.ambiguity_interval_m)
        };
        model.validate()?;
        Ok(model)
    }
}

/// Smallest and largest of some values; NaN is passed over.
fn span(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}
