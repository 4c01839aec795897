//! A variance that is linear in what it depends on: the straight line of the photon transfer.

use adjust::{Adjustment, Covariance, LinearObservation, ParameterBlock, Scale, SolveOptions};
use statistics::Distribution;

use super::bins::{Classes, VarianceBin};
use super::repeats::{AllRepeats, Repeats};
use super::{NoiseFitOptions, Steadiness};
use crate::{Error, Result};

/// Which variance of repeated values was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VarianceEstimator {
    /// About the mean: the most precise where nothing drifts.
    AboutMean,
    /// Half the mean square of successive differences, which a slow drift does not reach.
    SuccessiveDifferences,
}

impl VarianceEstimator {
    pub(super) fn variance(self, one: &Repeats) -> f64 {
        match self {
            Self::AboutMean => one.variance,
            Self::SuccessiveDifferences => one.successive,
        }
    }

    /// Degrees of freedom: `n − 1`, and `2 (n − 1)² / (3 n − 4)`, with which χ² has the variance of the other.
    pub(super) fn degrees(self, count: usize) -> f64 {
        let n = count as f64;
        match self {
            Self::AboutMean => n - 1.0,
            Self::SuccessiveDifferences => 2.0 * (n - 1.0).powi(2) / (3.0 * n - 4.0),
        }
    }
}

/// `variance = slope · regressor + level`, with what the data left open.
#[derive(Debug, Clone, PartialEq)]
pub struct VarianceFit {
    /// Increase of the variance with the regressor.
    pub slope: f64,
    /// Variance at a regressor of zero.
    pub level: f64,
    /// Covariance of slope and level, scaled by sigma0² where that is above 1; zero for what is held.
    pub covariance: [[f64; 2]; 2],
    /// Whether slope and level are held at the least that they can be, because the estimate was not above it.
    pub held: [bool; 2],
    /// Standard deviation of unit weight of the class means.
    pub sigma0: f64,
    /// Class means less unknowns.
    pub redundancy: i64,
    /// The class means that the line was fitted to.
    pub bins: Vec<VarianceBin>,
    /// Root mean square of `observed / modelled − 1` over the classes.
    pub misfit: f64,
    /// Probability of class means as far from the line, or farther, were no variance modelled worse than to 5 % (sigma to
    /// 2.5 %): below one in a thousand the line does not hold.
    pub misfit_p_value: f64,
    /// Values whose scatter no noise explains.
    pub moved: usize,
    /// All values.
    pub values: usize,
    /// Of so many pixels the values of one were taken: 1 for all, more where all stations together have too many.
    pub every: usize,
    /// Which variance was used.
    pub estimator: VarianceEstimator,
    /// What each station's frames say of drift.
    pub steadiness: Vec<Steadiness>,
}

/// A straight line with its quality.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) coefficients: [f64; 2],
    covariance: [[f64; 2]; 2],
    sigma0: f64,
    redundancy: i64,
}

impl Line {
    pub(super) fn at(&self, regressor: f64) -> f64 {
        self.coefficients[0] * regressor + self.coefficients[1]
    }
}

/// What the coefficients of a line can be.
#[derive(Debug, Clone, Copy)]
pub(super) struct LineRules {
    /// Least slope and level.
    pub(super) least: [f64; 2],
    /// Whether there is a slope at all.
    pub(super) sloped: bool,
    /// Names of the two parts, for messages.
    pub(super) parts: [&'static str; 2],
    /// Classes of a larger mean variance are left out.
    pub(super) largest_variance: f64,
    /// Of so many pixels one was taken.
    pub(super) every: usize,
}

/// Rounds of weighting and of leaving out after which nothing changes any more.
const MAX_ROUNDS: usize = 50;

/// Fits the line to repeats of all stations; the frames must not drift faster than the options allow.
pub(super) fn fit_variance(
    AllRepeats { values: repeats, steadiness, .. }: AllRepeats,
    rules: &LineRules,
    options: &NoiseFitOptions,
) -> Result<VarianceFit> {
    steadiness.iter().try_for_each(|station| station.require_slow(options))?;
    let drifts = steadiness.iter().any(|station| station.drifts);
    let estimator = if drifts { VarianceEstimator::SuccessiveDifferences } else { VarianceEstimator::AboutMean };
    let (classes, mut line) = normal_values(repeats, estimator, rules, options)?;
    let (mut bins, mut held, mut moved) = (Vec::new(), [false; 2], usize::MAX);
    for _ in 0..MAX_ROUNDS {
        let before = moved;
        (bins, moved) = classes.around_line(estimator, &line);
        (line, held) = bounded_line(&bins, rules)?;
        if moved == before {
            break;
        }
    }
    let values = classes.len();
    let share = moved as f64 / values as f64;
    if share > options.largest_moved_share {
        return Err(Error::SceneMoved { share, limit: options.largest_moved_share });
    }
    require_apart(&classes, &bins, rules)?;
    let misfit = misfit(&bins, &line);
    if misfit > options.largest_misfit {
        return Err(Error::NoiseDoesNotFit { misfit, limit: options.largest_misfit });
    }
    Ok(VarianceFit {
        slope: line.coefficients[0],
        level: line.coefficients[1],
        covariance: line.covariance,
        held,
        sigma0: line.sigma0,
        redundancy: line.redundancy,
        misfit,
        misfit_p_value: misfit_p_value(&bins, &line),
        bins,
        moved,
        values,
        every: rules.every,
        estimator,
        steadiness,
    })
}

/// The values in classes without those too dim to scatter normally, and the line through the usual variances.
///
/// A pixel that was lost has an amplitude near zero and any range: by its regressor alone it would turn the line.
fn normal_values(
    repeats: Vec<Repeats>,
    estimator: VarianceEstimator,
    rules: &LineRules,
    options: &NoiseFitOptions,
) -> Result<(Classes, Line)> {
    let mut classes = Classes::new(repeats, options.bins).below(estimator, rules.largest_variance);
    for _ in 0..MAX_ROUNDS {
        require_values(&classes)?;
        let (line, _) = bounded_line(&classes.around_medians(estimator), rules)?;
        let before = classes.len();
        classes = classes.expected_below(&line, rules.largest_variance, options.bins);
        if classes.len() == before {
            return Ok((classes, line));
        }
    }
    require_values(&classes)?;
    let (line, _) = bounded_line(&classes.around_medians(estimator), rules)?;
    Ok((classes, line))
}

/// Three classes of twenty values tell a line from its noise.
fn require_values(classes: &Classes) -> Result<()> {
    let (values, needed) = (classes.len(), 60);
    if values < needed { Err(Error::TooFewRepeats { values, needed }) } else { Ok(()) }
}

/// The line; a coefficient that comes out below its least is held there.
fn bounded_line(bins: &[VarianceBin], rules: &LineRules) -> Result<(Line, [bool; 2])> {
    let mut held = [!rules.sloped, false];
    let mut line = weighted_line(bins, rules.least, held)?;
    for index in [0, 1] {
        if held[index] || line.coefficients[index] >= rules.least[index] {
            continue;
        }
        let below = rules.least[index] - line.coefficients[index];
        let sigma = line.covariance[index][index].sqrt();
        // Four deviations below what can be is no chance.
        if below > 4.0 * sigma {
            return Err(Error::NegativeVariance { part: rules.parts[index], value: line.coefficients[index], sigma });
        }
        held[index] = true;
        line = weighted_line(bins, rules.least, held)?;
    }
    Ok((line, held))
}

/// Least squares with weights from the modelled variances, `σ² = 2 variance² / degrees`, until the weights stand.
fn weighted_line(bins: &[VarianceBin], least: [f64; 2], held: [bool; 2]) -> Result<Line> {
    let mut expected: Vec<f64> = bins.iter().map(|bin| bin.variance).collect();
    let smallest = expected.iter().copied().fold(f64::INFINITY, f64::min);
    let mut line = None;
    for _ in 0..MAX_ROUNDS {
        let found = one_line(bins, &expected, least, held)?;
        // A start below zero would weigh like none: no class is expected to be far below the smallest observed.
        let next: Vec<f64> = bins.iter().map(|bin| found.at(bin.regressor).max(0.5 * smallest)).collect();
        let change = next.iter().zip(&expected).map(|(new, old)| (new / old - 1.0).abs()).fold(0.0, f64::max);
        expected = next;
        line = Some(found);
        if change < 1e-9 {
            break;
        }
    }
    line.ok_or(Error::TooFewRepeats { values: 0, needed: 1 })
}

fn one_line(bins: &[VarianceBin], expected: &[f64], least: [f64; 2], held: [bool; 2]) -> Result<Line> {
    // Units of light and of variance differ by orders of magnitude: the adjustment sees numbers around one.
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::MIN_POSITIVE, |a, b| a.max(b.abs()));
    let unit = largest(&mut expected.iter().copied());
    let wide = largest(&mut bins.iter().map(|bin| bin.regressor));
    let scale = [unit / wide, unit];
    let mut network = Adjustment::new();
    let start = [least[0] / scale[0], least[1] / scale[1]];
    let block = network.add_block(ParameterBlock::euclidean(start).with_parameter_names(["slope", "level"]));
    for (component, _) in held.iter().enumerate().filter(|(_, held)| **held) {
        network.hold_parameter(block, component)?;
    }
    let group = network.add_group("variances");
    for (bin, expected) in bins.iter().zip(expected) {
        let row = [bin.regressor / wide, 1.0];
        let sigma = expected / unit * (2.0 / bin.degrees).sqrt();
        network.add_observation(
            group,
            LinearObservation::new(bin.variance / unit, [(block, row)]),
            &Covariance::from_sigma(sigma),
        )?;
    }
    let solution = network.solve(&SolveOptions::default())?;
    let values = solution.values(block)?;
    let covariance = solution.covariance(block, Scale::Prior)?;
    let sigma0 = solution.sigma0().unwrap_or(f64::NAN);
    let inflation = if sigma0 > 1.0 { sigma0 * sigma0 } else { 1.0 };
    let scaled = |i: usize, j: usize| covariance[(i, j)] * scale[i] * scale[j] * inflation;
    Ok(Line {
        coefficients: [values[0] * scale[0], values[1] * scale[1]],
        covariance: [[scaled(0, 0), scaled(0, 1)], [scaled(1, 0), scaled(1, 1)]],
        sigma0,
        redundancy: solution.redundancy(),
    })
}

fn misfit(bins: &[VarianceBin], line: &Line) -> f64 {
    let relative = bins.iter().map(|bin| (bin.variance / line.at(bin.regressor) - 1.0).powi(2));
    (relative.sum::<f64>() / bins.len() as f64).sqrt()
}

/// Relative error of a modelled variance that changes no sigma worth mentioning. Half of it lets exact models of thousands
/// of frames fail for their rounding, twice of it passes a sigma off by a tenth.
const HARMLESS: f64 = 0.05;

fn misfit_p_value(bins: &[VarianceBin], line: &Line) -> f64 {
    if line.redundancy <= 0 {
        return 1.0;
    }
    let relative = |bin: &VarianceBin| bin.variance / line.at(bin.regressor) - 1.0;
    let squares = bins.iter().map(|bin| relative(bin).powi(2) / (2.0 / bin.degrees + HARMLESS * HARMLESS));
    Distribution::ChiSquared { dof: line.redundancy as f64 }.survival(squares.sum())
}

/// Most that the noise of the regressor may flatten the slope.
const MOST_FLATTENING: f64 = 0.02;

/// Refuses light so uniform that the variance may come from either part.
///
/// Either the slope is so badly known that it may explain half of the variance or none of it (a quarter is one
/// deviation), or the regressor varies so little beside its own noise that this noise flattens the slope.
fn require_apart(classes: &Classes, bins: &[VarianceBin], rules: &LineRules) -> Result<()> {
    if !rules.sloped {
        return Ok(());
    }
    let all = classes.all();
    let count = all.len() as f64;
    let mean = all.iter().map(|one| one.regressor).sum::<f64>() / count;
    let spread = all.iter().map(|one| (one.regressor - mean).powi(2)).sum::<f64>() / count;
    let flattening = all.iter().map(|one| one.regressor_variance).sum::<f64>() / count / spread;
    let free = weighted_line(bins, rules.least, [false; 2])?;
    let variance = bins.iter().map(|bin| bin.variance).sum::<f64>() / bins.len() as f64;
    let open = free.covariance[0][0].sqrt() * mean / variance;
    if flattening < MOST_FLATTENING && open < 0.25 {
        return Ok(());
    }
    let span = [all.first(), all.last()].map(|one| one.map_or(f64::NAN, |one| one.regressor));
    Err(Error::NoisePartsNotApart { parts: rules.parts, span, flattening, open })
}
