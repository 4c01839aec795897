//! Whether amplitude or position in the image explains a range error (Sect. 4.3).
//!
//! Light falls off towards the corners of the image, so that dark pixels are pixels in the corners: either may stand for
//! the other. Both are put beside the other terms as series of their own, alone and together.

use adjust::{
    Adjustment, BlockId, Covariance, LinearObservation, ParameterBlock, Scale, Solution, SolveOptions, VarianceFactor,
};
use error_models::{ImageSurface, PolynomialShape, RangePolynomial, SurfaceShape};
use nalgebra::DMatrix;

use crate::observed::options::LinearTerms;
use crate::ranges::range_terms::{check_difference, design_rows, span};
use crate::{Error, RangeDifference, RangeTermOptions, Result};

/// A model is preferred where it lowers Schwarz's criterion by as much: odds of 150 to 1 `[Schwarz1978]`.
const CLEAR: f64 = 10.0;

/// Largest ratio of amplitudes below which they tell nothing. A choice: a hyperbola over a fifth of an amplitude is a
/// line, and an offset takes it up.
const LEAST_SPREAD: f64 = 1.2;

/// Highest order of the series in amplitude that is tried. A choice: Schwarz's criterion picks the order among
/// those up to it, so that a higher one costs time, and a lower one leaves the steep end of a hyperbola to the position.
const AMPLITUDE_ORDER: usize = 6;

/// Correlation of the two effects beyond which they are not told apart, whatever the tests say: so much of what no series
/// follows, a tenth, would be taken for the other. A larger one decides on less.
const LARGEST_CORRELATION: f64 = 0.995;

/// Options of [`amplitude_or_position`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeOrPositionOptions {
    /// The other terms, e1 and e2 among them; hyperbola and surface are not asked for here. Default: that of
    /// [`RangeTermOptions`].
    pub terms: RangeTermOptions,
    /// Highest order of the surface over the image that is tried, 2 to 6. Default 4.
    pub surface_order: usize,
    /// Level of the tests. Default 1 %.
    pub level: f64,
}

impl Default for AmplitudeOrPositionOptions {
    fn default() -> Self {
        Self { terms: RangeTermOptions::default(), surface_order: 4, level: 0.01 }
    }
}

/// What explains the error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorCause {
    /// Neither: the other terms are enough.
    Neither,
    /// The amplitude, and position adds nothing to it.
    Amplitude,
    /// The position in the image, and amplitude adds nothing to it.
    Position,
    /// Each adds to the other.
    Both,
    /// One of them does, but the differences do not tell which.
    Undecided,
}

/// One of the two effects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectTest {
    /// Order of its series.
    pub order: usize,
    /// F test beside the other terms alone: probability of so much without the effect.
    pub p_alone: f64,
    /// F test beside the other terms and the other effect.
    pub p_beside_the_other: f64,
    /// Root mean square of the effect over the differences where it stands alone, metre.
    pub rms_alone_m: f64,
    /// The same beside the other effect.
    pub rms_beside_the_other_m: f64,
    /// What it lowers Schwarz's criterion by beside the other effect; positive is better.
    pub gain_beside_the_other: f64,
}

/// The answer, with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeOrPosition {
    /// The verdict.
    pub cause: ErrorCause,
    /// Amplitude.
    pub amplitude: EffectTest,
    /// Position in the image.
    pub position: EffectTest,
    /// Largest correlation between an effect of one kind and an effect of the other, 0 to 1.
    pub correlation: f64,
    /// Options with hyperbola and surface as the verdict asks for; the given ones where it is undecided.
    pub terms: RangeTermOptions,
}

impl AmplitudeOrPosition {
    /// What to capture to tell the two apart; `None` where they are.
    pub fn advice(&self) -> Option<&'static str> {
        (self.cause == ErrorCause::Undecided).then_some(
            "show albedo steps in the centre of the image: a target of white, grey and black fields, seen at the same \
             distances in the centre and in each corner, so that dark pixels are not only those of the corners",
        )
    }
}

/// Tests whether a series in the amplitude, a surface over the image, both or neither is needed beside the other terms
/// to explain the differences, by F tests and Schwarz's criterion `[Schwarz1978]`.
///
/// The series are polynomials in the logarithm of the amplitude (the hyperbola of Eq. 15 is one curve of that kind) and
/// in the image coordinates, from the second order on; e1 and e2, the plane, belong to the other terms. Their orders are
/// those of the smallest criterion. Differences count as independent: where pixels share errors, thin them out.
///
/// # Errors
/// [`Error::NotDetermined`] where amplitude or position do not vary or the other terms are not determined;
/// [`Error::OutOfDomain`] for orders and options; what [`estimate_range_terms`](crate::estimate_range_terms) says of bad
/// differences.
pub fn amplitude_or_position(
    differences: &[RangeDifference],
    ambiguity_interval_m: f64,
    options: &AmplitudeOrPositionOptions,
) -> Result<AmplitudeOrPosition> {
    let design = Design::new(differences, ambiguity_interval_m, options)?;
    let amplitude_order = best_order(3..=AMPLITUDE_ORDER, |order| design.solve(Some(order), None))?;
    let surface_order = best_order(2..=options.surface_order, |order| design.solve(None, Some(order)))?;
    let alone = [design.solve(Some(amplitude_order), None)?, design.solve(None, Some(surface_order))?];
    let both = match design.solve(Some(amplitude_order), Some(surface_order)) {
        Ok(both) => both,
        // What the one does the other does exactly as well.
        Err(Error::NotDetermined { .. }) => return design.inseparable(&alone, [amplitude_order, surface_order]),
        Err(error) => return Err(error),
    };
    let orders = [amplitude_order, surface_order];
    let test = |effect: usize| -> Result<EffectTest> {
        Ok(EffectTest {
            order: orders[effect],
            p_alone: alone[effect].p_value(effect)?,
            p_beside_the_other: both.p_value(effect)?,
            rms_alone_m: alone[effect].rms_m(effect)?,
            rms_beside_the_other_m: both.rms_m(effect)?,
            gain_beside_the_other: alone[1 - effect].criterion()? - both.criterion()?,
        })
    };
    let (amplitude, position) = (test(0)?, test(1)?);
    let correlation = both.correlation()?;
    let cause = cause(&amplitude, &position, correlation, options);
    Ok(AmplitudeOrPosition { cause, amplitude, position, correlation, terms: design.terms_for(cause, orders) })
}

fn cause(
    amplitude: &EffectTest,
    position: &EffectTest,
    correlation: f64,
    options: &AmplitudeOrPositionOptions,
) -> ErrorCause {
    let there = |test: &EffectTest| test.p_alone < options.level;
    if !there(amplitude) && !there(position) {
        return ErrorCause::Neither;
    }
    let needed = |test: &EffectTest| test.p_beside_the_other < options.level && test.gain_beside_the_other > CLEAR;
    match (needed(amplitude), needed(position)) {
        _ if correlation > LARGEST_CORRELATION => ErrorCause::Undecided,
        (true, true) => ErrorCause::Both,
        (true, false) => ErrorCause::Amplitude,
        (false, true) => ErrorCause::Position,
        (false, false) => ErrorCause::Undecided,
    }
}

/// The order of the smallest criterion.
fn best_order<'a>(
    orders: std::ops::RangeInclusive<usize>,
    solve: impl Fn(usize) -> Result<Adjusted<'a>>,
) -> Result<usize> {
    let mut best = (f64::INFINITY, *orders.start());
    for order in orders {
        let criterion = solve(order)?.criterion()?;
        if criterion < best.0 {
            best = (criterion, order);
        }
    }
    Ok(best.1)
}

/// The differences with everything that does not change from model to model.
struct Design<'a> {
    differences: &'a [RangeDifference],
    options: &'a AmplitudeOrPositionOptions,
    terms: LinearTerms,
    rows: Vec<f64>,
    logarithms: [f64; 2],
    image: [[f64; 2]; 2],
    range_span_m: [f64; 2],
}

/// One model adjusted: the blocks of amplitude and position, where there are any, with their rows.
struct Adjusted<'a> {
    solution: Solution,
    effects: [Option<(BlockId, Vec<Vec<f64>>)>; 2],
    differences: &'a [RangeDifference],
}

impl<'a> Design<'a> {
    fn new(
        differences: &'a [RangeDifference],
        ambiguity_interval_m: f64,
        options: &'a AmplitudeOrPositionOptions,
    ) -> Result<Self> {
        let refuse = |name, value, expected| Err(Error::OutOfDomain { name, value, expected });
        if !(2..=ImageSurface::ORDERS[1]).contains(&options.surface_order) {
            return refuse("surface_order", options.surface_order as f64, "an order from 2 to 6");
        }
        if !(options.level > 0.0 && options.level < 1.0) {
            return refuse("level", options.level, "a probability between 0 and 1");
        }
        options.terms.validate()?;
        for (index, difference) in differences.iter().enumerate() {
            check_difference(difference, index)?;
            if !(difference.amplitude > 0.0 && difference.amplitude.is_finite()) {
                let (name, value) = ("amplitude", difference.amplitude);
                return Err(Error::BadDifference { index, name, value, expected: "a positive amplitude" });
            }
        }
        let mut terms = options.terms;
        terms.further.surface = None;
        let terms = LinearTerms::new(&terms, ambiguity_interval_m)?;
        let unknowns = terms.unknowns() + AMPLITUDE_ORDER + 30;
        if differences.len() <= unknowns {
            return Err(Error::TooFewDifferences { differences: differences.len(), unknowns });
        }
        let rows = design_rows(differences, &terms.model)?;
        let logarithms = span(differences.iter().map(|d| d.amplitude.ln()));
        let image = [span(differences.iter().map(|d| d.x_mm)), span(differences.iter().map(|d| d.y_mm))];
        let range_span_m = span(differences.iter().map(|d| d.observed_range_m));
        let design = Self { differences, options, terms, rows, logarithms, image, range_span_m };
        if logarithms[1] - logarithms[0] < LEAST_SPREAD.ln() {
            return Err(design.not_determined("the amplitude, which hardly varies"));
        }
        if image.iter().any(|[low, high]| high <= low) {
            return Err(design.not_determined("the position, as all differences lie on a line of the image"));
        }
        Ok(design)
    }

    fn not_determined(&self, combination: &str) -> Error {
        let (combination, range_span_m) = (combination.to_owned(), self.range_span_m);
        Error::NotDetermined { combination, inflation: f64::INFINITY, range_span_m }
    }

    /// Adjusts the other terms with a series in amplitude and a surface of these orders.
    fn solve(&self, amplitude: Option<usize>, surface: Option<usize>) -> Result<Adjusted<'a>> {
        let mut adjustment = Adjustment::new();
        let terms = adjustment.add_block(self.terms.block());
        self.terms.hold(&mut adjustment, terms)?;
        let mut effects: [Option<(BlockId, Vec<Vec<f64>>)>; 2] = [None, None];
        let rows = [
            amplitude.map(|order| self.amplitude_rows(order)).transpose()?,
            surface.map(|order| self.surface_rows(order)).transpose()?,
        ];
        for ((effect, rows), name) in effects.iter_mut().zip(rows).zip(["amplitude", "position"]) {
            if let Some(rows) = rows {
                let zeros = vec![0.0; rows.first().map_or(0, Vec::len)];
                *effect = Some((adjustment.add_block(ParameterBlock::euclidean(zeros).named(name)), rows));
            }
        }
        let group = adjustment.add_group("range differences");
        let width = self.terms.model.parameter_count();
        for (index, (d, row)) in self.differences.iter().zip(self.rows.chunks_exact(width)).enumerate() {
            let further = effects.iter().flatten().map(|(block, rows)| (*block, rows[index].clone()));
            let parts = std::iter::once((terms, row.to_vec())).chain(further);
            let observation = LinearObservation::new(d.observed_range_m - d.reference_range_m, parts);
            adjustment.add_observation(group, observation, &Covariance::from_sigma(d.sigma_m))?;
        }
        match adjustment.solve(&SolveOptions::default()) {
            Ok(solution) => Ok(Adjusted { solution, effects, differences: self.differences }),
            Err(adjust::Error::RankDeficient { combinations, .. }) => {
                let names: Vec<String> = combinations.iter().map(ToString::to_string).collect();
                Err(self.not_determined(&names.join("; ")))
            }
            Err(error) => Err(error.into()),
        }
    }

    /// Polynomials in the logarithm of the amplitude.
    fn amplitude_rows(&self, order: usize) -> Result<Vec<Vec<f64>>> {
        let series = RangePolynomial::zero(&PolynomialShape { order, range_span_m: self.logarithms })?;
        let row = |d: &RangeDifference| {
            let mut row = vec![0.0; order];
            series.design_row(d.amplitude.ln(), &mut row);
            row
        };
        Ok(self.differences.iter().map(row).collect())
    }

    /// The surface without its plane, which e1 and e2 are.
    fn surface_rows(&self, order: usize) -> Result<Vec<Vec<f64>>> {
        let surface = ImageSurface::zero(&self.surface(order))?;
        let row = |d: &RangeDifference| {
            let mut row = vec![0.0; surface.coefficients.len()];
            surface.design_row(d.x_mm, d.y_mm, &mut row);
            row.split_off(2)
        };
        Ok(self.differences.iter().map(row).collect())
    }

    fn surface(&self, order: usize) -> SurfaceShape {
        SurfaceShape { order, x_span_mm: self.image[0], y_span_mm: self.image[1] }
    }

    /// Options for the calibration that the verdict asks for.
    fn terms_for(&self, cause: ErrorCause, [_, surface_order]: [usize; 2]) -> RangeTermOptions {
        let mut terms = self.options.terms;
        if matches!(cause, ErrorCause::Amplitude | ErrorCause::Both) {
            terms = terms.with_hyperbola();
        }
        if matches!(cause, ErrorCause::Position | ErrorCause::Both) {
            terms = terms.with_surface(self.surface(surface_order));
        }
        terms
    }

    /// The answer where each effect is a function of the other.
    fn inseparable(&self, alone: &[Adjusted<'_>; 2], orders: [usize; 2]) -> Result<AmplitudeOrPosition> {
        let test = |effect: usize| -> Result<EffectTest> {
            Ok(EffectTest {
                order: orders[effect],
                p_alone: alone[effect].p_value(effect)?,
                p_beside_the_other: 1.0,
                rms_alone_m: alone[effect].rms_m(effect)?,
                rms_beside_the_other_m: 0.0,
                gain_beside_the_other: 0.0,
            })
        };
        let (amplitude, position, correlation) = (test(0)?, test(1)?, 1.0);
        let cause = cause(&amplitude, &position, correlation, self.options);
        Ok(AmplitudeOrPosition { cause, amplitude, position, correlation, terms: self.options.terms })
    }
}

impl Adjusted<'_> {
    fn criterion(&self) -> Result<f64> {
        Ok(self.solution.information_criteria(VarianceFactor::Unknown)?.bic)
    }

    /// F test of all coefficients of an effect.
    fn p_value(&self, effect: usize) -> Result<f64> {
        let Some((block, rows)) = &self.effects[effect] else { return Ok(1.0) };
        let all: Vec<_> = (0..rows.first().map_or(0, Vec::len)).map(|component| (*block, component)).collect();
        Ok(self.solution.significance(&all, Scale::Posterior)?.p_value)
    }

    /// Root mean square of an effect about its mean, which belongs to the offset.
    fn rms_m(&self, effect: usize) -> Result<f64> {
        let Some((block, rows)) = &self.effects[effect] else { return Ok(0.0) };
        let values = self.solution.values(*block)?;
        let effects = rows.iter().map(|row| row.iter().zip(values).map(|(d, value)| d * value).sum::<f64>());
        let count = self.differences.len() as f64;
        let (sum, squares) = effects.fold((0.0, 0.0), |(sum, squares), m| (sum + m, squares + m * m));
        Ok((squares / count - (sum / count).powi(2)).max(0.0).sqrt())
    }

    /// Largest canonical correlation between the coefficients of both effects.
    fn correlation(&self) -> Result<f64> {
        let [Some((amplitude, _)), Some((position, _))] = &self.effects else { return Ok(0.0) };
        let whitened = |block: BlockId| -> Result<DMatrix<f64>> {
            let covariance = self.solution.covariance(block, Scale::Prior)?;
            let factor = covariance.cholesky().map(|factor| factor.l());
            factor.and_then(nalgebra::Matrix::try_inverse).ok_or(Error::Adjust(adjust::Error::Untestable {
                what: "amplitude and position".to_owned(),
                reason: "their coefficients depend on each other",
            }))
        };
        let between = self.solution.covariance_between(*amplitude, *position, Scale::Prior)?;
        let canonical = whitened(*amplitude)? * between * whitened(*position)?.transpose();
        Ok(canonical.singular_values().max().min(1.0))
    }
}
