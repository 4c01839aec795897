//! The second step of the two-step methods and the laboratory method: range terms from reference ranges.
//!
//! The weakest combination is sought beside deviations of an adjustment with the reference known. With those of
//! `Solution::near_defects`, taken at the solution found, `cargo xtask verify calibrations` names 261 of 269 broken networks
//! instead of 262 (depths given for all ranges, with control).

use std::collections::BTreeSet;
use std::sync::Arc;

use adjust::{
    Adjustment, BlockId, Covariance, EvaluationFailure, Jacobians, Observation, ParameterBlock, Scale, Solution,
    SolveOptions,
};
use calibration_network::functional_model::{
    PartialPrior, RangeSet, Seen, Setup, by_steps, covariance_of_terms, family_widths, has_natural_steps,
    modelled_range, range_block, range_model_from, range_names,
};
use calibration_network::precision::covariance_of;
use calibration_network::start_values::start_range_limit;
use calibration_network::weakness::{Motions, Strength, combination, weakest};
use error_models::RangeErrorModel;
use nalgebra::DMatrix;
use statistics::upper_median;

use crate::methods::reference::Reference;
use crate::methods::score::range_scores;
use crate::outliers::rejection::suspects;
use crate::{CalibrationOptions, Component, Error, Result, TermScore};

/// Most reference ranges and uncertain quantities behind them that the dense second step takes together: a hundred
/// million numbers.
const LARGEST: usize = 100_000_000;

/// `ρ − λ (ρ_ref + root · z) = Δρ(ρ, x, y, a)` for the modelled range ρ. Blocks: scale λ, range set, and z where the reference is uncertain.
struct DifferenceEquation {
    blocks: Vec<BlockId>,
    observed_m: f64,
    reference_m: f64,
    root: Vec<f64>,
    seen: Seen,
    model: Arc<RangeErrorModel>,
    widths: Arc<[usize]>,
    natural_steps: bool,
}

impl Observation for DifferenceEquation {
    fn dimension(&self) -> usize {
        1
    }

    fn blocks(&self) -> &[BlockId] {
        &self.blocks
    }

    fn evaluate(
        &self,
        parameters: &[&[f64]],
        residual: &mut [f64],
        jacobians: Option<&mut Jacobians<'_>>,
    ) -> std::result::Result<(), EvaluationFailure> {
        let (scale, terms) = (parameters[0][0], parameters[1]);
        let moved: f64 = parameters.get(2).map_or(0.0, |z| z.iter().zip(&self.root).map(|(z, r)| z * r).sum());
        let reference = self.reference_m + moved;
        let mut by_terms = vec![0.0; terms.len()];
        let distance = scale * reference;
        let modelled = modelled_range(&self.model, &self.widths, &self.seen, terms, distance, &mut by_terms);
        let modelled = modelled.map_err(EvaluationFailure::new)?;
        residual[0] = self.observed_m - modelled.range_m;
        if self.natural_steps {
            by_steps(terms, &mut by_terms);
        }
        if let Some(jacobians) = jacobians {
            jacobians.row(0, 0).copy_from_slice(&[reference * modelled.by_distance]);
            jacobians.row(1, 0).copy_from_slice(&by_terms);
            if parameters.len() > 2 {
                jacobians
                    .row(2, 0)
                    .iter_mut()
                    .zip(&self.root)
                    .for_each(|(out, r)| *out = scale * modelled.by_distance * r);
            }
        }
        Ok(())
    }
}

/// The range terms found, with what they share with the first step.
#[derive(Debug)]
pub(crate) struct RangeStep {
    pub(crate) solution: Solution,
    pub(crate) reference: Reference,
    pub(crate) rejected: BTreeSet<usize>,
    pub(crate) sets: Vec<RangeSet>,
    /// Names of the estimated terms and their covariance.
    pub(crate) names: Vec<String>,
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) first_order: DMatrix<f64>,
    /// Covariance of the steps in which the terms were adjusted.
    steps: DMatrix<f64>,
    /// Covariance between [`Reference::carried`] (rows) and the terms (columns).
    pub(crate) carried: DMatrix<f64>,
    /// Scale of the first step, its variance and its covariance with [`Reference::carried`]; where the ranges gave it.
    pub(crate) scale: Option<(f64, f64, Vec<f64>)>,
    /// Deviations of the terms if all else were known.
    alone: Vec<f64>,
    /// Score tests of range terms that are not estimated.
    pub(crate) unestimated: Vec<TermScore>,
}

/// Whether the first step left its scale to the ranges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ScaleUse {
    Known,
    Estimated,
}

struct Terms {
    scale: BlockId,
    sets: Vec<BlockId>,
    latent: Option<BlockId>,
    /// Names, blocks and components of what is estimated.
    estimated: Vec<(String, BlockId, usize)>,
}

impl RangeStep {
    /// Estimates range terms from the ranges of the reference.
    pub(crate) fn solve(
        setup: &Setup<'_>,
        reference: &Reference,
        scale: ScaleUse,
        options: &CalibrationOptions,
    ) -> Result<Self> {
        if reference.values.len() * reference.root.ncols() > LARGEST {
            let (ranges, behind) = (reference.values.len(), reference.root.ncols());
            let needs =
                format!("{ranges} ranges with {behind} uncertain coordinates are too many for its dense second step");
            return Err(Error::MethodNeeds { method: format!("{:?}", options.method), needs });
        }
        let mut rejected = if options.rejection_level.is_some() { far_off(setup, reference) } else { BTreeSet::new() };
        // A correction is a function of the image point: where none is modelled, the range takes no part.
        let seen = reference.sightings.iter().zip(&reference.pixels);
        let unseen: BTreeSet<usize> = seen.filter(|(_, pixel)| pixel.is_none()).map(|(index, _)| *index).collect();
        loop {
            let kept = reference.without(&(&rejected | &unseen));
            let (solution, terms) = adjusted(setup, &kept, scale)?;
            let before = rejected.len();
            if let Some(level) = options.rejection_level {
                reject(setup, &kept, &solution, level, &mut rejected)?;
            }
            if rejected.len() == before {
                return Self::new(setup, kept, rejected, solution, &terms, scale);
            }
        }
    }

    fn new(
        setup: &Setup<'_>,
        reference: Reference,
        rejected: BTreeSet<usize>,
        solution: Solution,
        terms: &Terms,
        scale: ScaleUse,
    ) -> Result<Self> {
        let places: Vec<_> = terms.estimated.iter().map(|(_, block, component)| (*block, *component)).collect();
        let steps = covariance_of(&solution, &places)?;
        let mut sets = setup.calibration.sets.clone();
        for (set, &block) in sets.iter_mut().zip(&terms.sets) {
            set.model = range_model_from(&set.model, solution.values(block)?);
        }
        // An error of the first step, L ζ, comes into the terms as an error ζ of the observed z = 0: cov = L · cov(z, terms).
        let shared = |block: BlockId, component: usize| -> Result<Vec<f64>> {
            let Some(latent) = terms.latent else { return Ok(vec![0.0; reference.carried.nrows()]) };
            let between = solution.covariance_between(latent, block, Scale::Prior)?;
            Ok((&reference.carried * between.column(component)).iter().copied().collect())
        };
        let mut carried = DMatrix::zeros(reference.carried.nrows(), places.len());
        for (column, &(block, component)) in places.iter().enumerate() {
            carried.column_mut(column).copy_from_slice(&shared(block, component)?);
        }
        let scale = match scale {
            ScaleUse::Known => None,
            ScaleUse::Estimated => {
                let variance = solution.covariance(terms.scale, Scale::Prior)?[(0, 0)];
                Some((solution.values(terms.scale)?[0], variance, shared(terms.scale, 0)?))
            }
        };
        let alone = deviations_alone(setup, &reference, terms)?;
        let names: Vec<String> = terms.estimated.iter().map(|(name, ..)| name.clone()).collect();
        let of_terms = covariance_of_terms(&names, [&setup.calibration.sets, &sets], &setup.estimated, &steps);
        let carried = carried * of_terms.by_steps.transpose();
        let (covariance, first_order) = (of_terms.full, of_terms.first_order);
        let unestimated = range_scores(setup, &solution, &reference, reference.root.ncols());
        Ok(Self {
            solution,
            reference,
            rejected,
            sets,
            names,
            covariance,
            first_order,
            steps,
            carried,
            scale,
            alone,
            unestimated,
        })
    }

    /// The weakest combination of the range terms.
    pub(crate) fn strength(&self, setup: &Setup<'_>) -> Option<Strength> {
        if self.names.is_empty() {
            return None;
        }
        let (direction, inflation) = weakest(&self.steps, &self.alone);
        let combination = combination(&direction, &self.names);
        let correlation = "from the reference ranges alone".to_owned();
        let advice = setup.advice(&combination, &Motions { distance: 1.0, ..Motions::default() });
        Some(Strength { inflation, combination, correlation, advice })
    }
}

/// One adjustment of the differences.
fn adjusted(setup: &Setup<'_>, reference: &Reference, scale: ScaleUse) -> Result<(Solution, Terms)> {
    let mut adjustment = Adjustment::new();
    let terms = add_blocks(setup, reference, scale, &mut adjustment)?;
    let group = adjustment.add_group("ranges");
    let models: Vec<(Arc<RangeErrorModel>, Arc<[usize]>, bool)> = setup
        .calibration
        .sets
        .iter()
        .map(|set| {
            let natural_steps = has_natural_steps(&set.model, &setup.estimated);
            (Arc::new(set.model.clone()), family_widths(&set.model).into(), natural_steps)
        })
        .collect();
    for (row, (&index, &reference_m)) in reference.sightings.iter().zip(&reference.values).enumerate() {
        let seen = &setup.network.sightings[index];
        let (Some(observed_m), Some(values)) = (seen.range_m, observed(setup, index, reference.pixels[row])) else {
            continue;
        };
        let set = setup.set_of(seen.station);
        let mut blocks = vec![terms.scale, terms.sets[set]];
        blocks.extend(terms.latent);
        let (model, widths, natural_steps) = models[set].clone();
        let root = reference.root.row(row).iter().copied().collect();
        let equation =
            DifferenceEquation { blocks, observed_m, reference_m, root, seen: values, model, widths, natural_steps };
        adjustment.add_observation(group, equation, &Covariance::from_sigma(seen.sigma_range_m))?;
    }
    add_term_priors(setup, &terms, &mut adjustment)?;
    match adjustment.solve(&SolveOptions::default()) {
        Ok(solution) => Ok((solution, terms)),
        Err(adjust::Error::RankDeficient { combinations, .. }) => Err(setup.undetermined(&combinations).into()),
        Err(error) => Err(error.into()),
    }
}

/// After the ranges, so that these keep their rows.
fn add_term_priors(setup: &Setup<'_>, terms: &Terms, adjustment: &mut Adjustment<'_>) -> Result<()> {
    let group = adjustment.prior_group();
    for (set, &block) in setup.calibration.sets.iter().zip(&terms.sets) {
        let Some(prior) = setup.term_prior(&range_names(&set.model)) else { continue };
        let equation = PartialPrior { block: [block], known: prior.known };
        adjustment.add_observation(group, equation, &Covariance::from_matrix(&prior.covariance))?;
    }
    Ok(())
}

fn add_blocks(
    setup: &Setup<'_>,
    reference: &Reference,
    scale: ScaleUse,
    adjustment: &mut Adjustment<'_>,
) -> Result<Terms> {
    let scale_block = adjustment.add_block(ParameterBlock::euclidean([1.0]).named("scale"));
    if scale == ScaleUse::Known {
        adjustment.hold(scale_block)?;
    }
    let mut terms = Terms { scale: scale_block, sets: Vec::new(), latent: None, estimated: Vec::new() };
    for set in &setup.calibration.sets {
        let names = range_names(&set.model);
        let block = range_block(&set.model, &setup.estimated).named("range terms");
        let suffixed = names.iter().map(|name| format!("{name}{}", set.suffix));
        let block = adjustment.add_block(block.with_parameter_names(suffixed));
        for (component, name) in names.iter().enumerate() {
            if setup.estimated.contains(name) {
                terms.estimated.push((format!("{name}{}", set.suffix), block, component));
            } else {
                adjustment.hold_parameter(block, component)?;
            }
        }
        terms.sets.push(block);
    }
    let behind = reference.root.ncols();
    if behind > 0 {
        let zeros = vec![0.0; behind];
        let block = adjustment.add_block(ParameterBlock::euclidean(zeros.clone()).named("first step"));
        let deviations = vec![1.0; behind];
        adjustment.add_prior(block, &zeros, &Covariance::from_sigmas(&deviations))?;
        terms.latent = Some(block);
    }
    Ok(terms)
}

/// What the correction of a sighting's range is a function of.
fn observed(setup: &Setup<'_>, index: usize, pixel: Option<[f64; 2]>) -> Option<Seen> {
    let seen = &setup.network.sightings[index];
    let camera = &setup.calibration.camera;
    let [x, y] = camera.format.image_from_pixel(pixel?);
    let [xp, yp] = camera.interior.principal_point_mm;
    let amplitude = seen.amplitude.unwrap_or(f64::NAN);
    let drift_m = setup.network.stations[seen.station].drift_m;
    Some(Seen { range_m: seen.range_m?, x_mm: x - xp, y_mm: y - yp, amplitude, drift_m })
}

/// Ranges that no range term explains: a whole ambiguity interval or another unit away from the reference.
fn far_off(setup: &Setup<'_>, reference: &Reference) -> BTreeSet<usize> {
    let known = reference.sightings.iter().zip(&reference.values);
    let off = known.filter_map(|(&index, value)| Some((index, setup.network.sightings[index].range_m? - value)));
    let off: Vec<(usize, f64)> = off.collect();
    let offset = upper_median(&mut off.iter().map(|(_, off)| *off).collect::<Vec<f64>>());
    let spread = upper_median(&mut off.iter().map(|(_, off)| (off - offset).abs()).collect::<Vec<f64>>());
    let limit = start_range_limit(setup.network, spread);
    off.into_iter().filter(|(_, off)| (off - offset).abs() > limit).map(|(index, _)| index).collect()
}

/// Rejects the worst range of each station and target.
fn reject(
    setup: &Setup<'_>,
    reference: &Reference,
    solution: &Solution,
    level: f64,
    rejected: &mut BTreeSet<usize>,
) -> Result<()> {
    let latent = reference.root.ncols();
    let mut groups = vec![(0, Component::Control); latent];
    groups.extend(reference.values.iter().map(|_| (0, Component::Range)));
    groups.extend(std::iter::repeat_n((0, Component::Term), solution.residuals().len() - groups.len()));
    let (mut stations, mut targets) = (BTreeSet::new(), BTreeSet::new());
    for suspect in suspects(solution, &groups, level)? {
        let row = suspect.row.checked_sub(latent).filter(|row| *row < reference.values.len());
        let Some(row) = row else { continue };
        let seen = &setup.network.sightings[reference.sightings[row]];
        if stations.insert(seen.station) & targets.insert(seen.target) {
            rejected.insert(reference.sightings[row]);
        }
    }
    Ok(())
}

/// Deviation of each estimated term if all others and the reference were known.
fn deviations_alone(setup: &Setup<'_>, reference: &Reference, terms: &Terms) -> Result<Vec<f64>> {
    let known = Reference { root: DMatrix::zeros(reference.values.len(), 0), ..reference.clone() };
    let (solution, _) = adjusted(setup, &known, ScaleUse::Known)?;
    // Without the latent block the others keep their numbers.
    let places: Vec<_> = terms.estimated.iter().map(|(_, block, component)| (*block, *component)).collect();
    let covariance = covariance_of(&solution, &places)?;
    let normal = covariance.clone().cholesky().map(|factor| factor.inverse());
    let conditional = |i: usize| normal.as_ref().map_or(covariance[(i, i)], |normal| 1.0 / normal[(i, i)]).sqrt();
    Ok((0..places.len()).map(conditional).collect())
}
