//! The methods of Sect. 5.3: which adjustments they consist of.

use std::collections::BTreeSet;

use calibration_network::functional_model::{
    BlockPrior, Datum, Excluded, Setup, Solved, Start, camera_names, camera_values,
};
use calibration_network::precision::{Geometry, covariance_of};
use calibration_network::start_values::start_calibration;
use calibration_network::weakness::Strength;

use crate::findings::outcome::outcome;
use crate::methods::combine::{Combined, combine, given};
use crate::methods::range_step::{RangeStep, ScaleUse};
use crate::methods::reference::Reference;
use crate::methods::score::term_scores;
use crate::options::{datum, ranged_stations};
use crate::outliers::rejection::solve_rejecting;
use crate::{CalibrationOptions, CalibrationOutcome, Error, Method, Network, NetworkError, Result, TermSelection};

/// Inflation from which on the weakest combination is told although it is accepted.
const WORTH_TELLING: f64 = 100.0;

/// What is to be calibrated, with whatever terms.
pub(crate) struct Problem<'n> {
    pub(crate) network: &'n Network,
    pub(crate) lens: Option<&'n Network>,
    pub(crate) options: &'n CalibrationOptions,
    /// Whether adjustments begin where most observations agree, and not at the start values.
    pub(crate) robust: bool,
}

impl Problem<'_> {
    /// Calibrates with these terms estimated.
    pub(crate) fn run(&self, terms: &BTreeSet<String>) -> Result<CalibrationOutcome> {
        match self.options.method {
            Method::OneStep => self.integrated(terms, false),
            Method::JointIntegrated => self.integrated(terms, true),
            Method::TwoStepDependent => self.dependent(terms, false),
            Method::JointTwoStep => self.dependent(terms, true),
            Method::TwoStepIndependent => self.independent(terms),
            Method::Laboratory => self.laboratory(terms),
        }
    }

    fn integrated(&self, terms: &BTreeSet<String>, passive: bool) -> Result<CalibrationOutcome> {
        let ranged = ranged_stations(self.network, self.options);
        let datum = datum(self.network, self.options)?;
        let mut setup = self.setup(self.network, terms, ranged, passive, datum)?;
        let (solved, diagnosis) = self.solve(&mut setup)?;
        let mut outcome = outcome(&setup, &solved, self.options)?;
        outcome.diagnosis = diagnosis;
        if self.is_listed() {
            outcome.unestimated = term_scores(&setup, &solved, &outcome.groups)?;
        }
        Ok(outcome)
    }

    /// Whether terms are listed: there are others then.
    fn is_listed(&self) -> bool {
        matches!(self.options.terms, TermSelection::List(_))
    }

    fn dependent(&self, terms: &BTreeSet<String>, passive: bool) -> Result<CalibrationOutcome> {
        let datum = datum(self.network, self.options)?;
        let none = vec![false; self.network.stations.len()];
        let mut setup = self.setup(self.network, terms, none, passive, datum)?;
        let (solved, diagnosis) = self.solve(&mut setup)?;
        let scaled = datum != Datum::Inner || setup.has_scale();
        let scale = if scaled { ScaleUse::Known } else { ScaleUse::Estimated };
        self.second_step(&setup, &solved, scale, diagnosis, None)
    }

    fn independent(&self, terms: &BTreeSet<String>) -> Result<CalibrationOutcome> {
        let Some(lens) = self.lens else {
            return Err(self.needs("a network for the lens and one for the ranges (`calibrate_two_networks`)"));
        };
        self.require_known_targets()?;
        let none = vec![false; lens.stations.len()];
        let mut first = self.setup(lens, terms, none, false, datum(lens, self.options)?)?;
        let (solved_lens, mut diagnosis) = self.solve(&mut first)?;
        let found = first.calibration_found(&solved_lens)?;
        let none = vec![false; self.network.stations.len()];
        let mut setup = self.setup(self.network, terms, none, false, Datum::Known)?;
        setup.calibration.camera = found.camera;
        setup.camera_prior = camera_prior(&first, &solved_lens)?;
        let (solved, more) = self.solve(&mut setup)?;
        diagnosis.extend(more);
        let lens_outcome = outcome(&first, &solved_lens, self.options)?;
        self.second_step(&setup, &solved, ScaleUse::Known, diagnosis, Some(lens_outcome))
    }

    fn second_step(
        &self,
        setup: &Setup<'_>,
        solved: &Solved,
        scale: ScaleUse,
        mut diagnosis: Vec<String>,
        before: Option<CalibrationOutcome>,
    ) -> Result<CalibrationOutcome> {
        let sightings = self.ranged_sightings(|index| solved.blocks.targets[index].is_some())?;
        let reference = Reference::from_network(setup, solved, sightings)?;
        let mut second = setup.clone();
        second.calibration.camera = setup.calibration_found(solved)?.camera;
        let step = self.range_step(&second, &reference, scale, &mut diagnosis)?;
        let first = outcome(setup, solved, self.options)?;
        let mut unestimated = if self.is_listed() { term_scores(setup, solved, &first.groups)? } else { Vec::new() };
        unestimated.extend(step.unestimated.iter().filter(|_| self.is_listed()).cloned());
        let first_names = setup.estimate(solved)?.names;
        let parts =
            Combined { setup: &second, first, first_names, step, reference, geometry: solved.geometry()?, before };
        let mut outcome = combine(parts, self.options)?;
        outcome.diagnosis = diagnosis;
        outcome.unestimated = unestimated;
        Ok(outcome)
    }

    fn laboratory(&self, terms: &BTreeSet<String>) -> Result<CalibrationOutcome> {
        let sightings = self.ranged_sightings(|_| true)?;
        let reference = Reference::from_laboratory(self.network, sightings)?;
        let setup = Setup {
            network: self.network,
            start: Start { stations: Vec::new(), targets: Vec::new(), relative: None, mounting: None },
            unused: None,
            calibration: start_calibration(self.network),
            estimated: terms.iter().filter(|name| !camera_names().contains(&name.as_str())).cloned().collect(),
            ranged: ranged_stations(self.network, self.options),
            passive: false,
            datum: Datum::Known,
            geometry_held: false,
            camera_prior: None,
            term_sigmas: self.options.terms.sigmas(self.network),
            excluded: Excluded::default(),
        };
        let mut diagnosis = Vec::new();
        let step = self.range_step(&setup, &reference, ScaleUse::Known, &mut diagnosis)?;
        let unestimated = if self.is_listed() { step.unestimated.clone() } else { Vec::new() };
        let first = given(&setup, self.options);
        let geometry = Geometry::default();
        let parts = Combined { setup: &setup, first, first_names: Vec::new(), step, reference, geometry, before: None };
        let mut outcome = combine(parts, self.options)?;
        outcome.diagnosis = diagnosis;
        outcome.unestimated = unestimated;
        Ok(outcome)
    }

    fn range_step(
        &self,
        setup: &Setup<'_>,
        reference: &Reference,
        scale: ScaleUse,
        diagnosis: &mut Vec<String>,
    ) -> Result<RangeStep> {
        let step = RangeStep::solve(setup, reference, scale, self.options)?;
        if let Some(strength) = step.strength(setup) {
            if strength.inflation > self.options.largest_inflation {
                return Err(strength.error().into());
            }
            if strength.inflation > WORTH_TELLING {
                diagnosis.push(strength.sentence());
            }
        }
        Ok(step)
    }

    /// Solves one adjustment and refuses what it does not determine.
    fn solve(&self, setup: &mut Setup<'_>) -> Result<(Solved, Vec<String>)> {
        let limit = self.options.largest_inflation;
        let first = self.first(setup)?;
        // Gross errors are looked for only where the network is strong enough for an answer.
        let mut strength = self.strong(setup, &first)?;
        let kept = setup.excluded.clone();
        let solved = solve_rejecting(setup, first, self.options.rejection_level);
        let solved = solved.map_err(|error| setup.explain(error, limit))?;
        if setup.excluded != kept {
            strength = self.strong(setup, &solved)?;
        }
        let worth_telling = strength.filter(|strength| strength.inflation > WORTH_TELLING);
        let mut diagnosis: Vec<String> = worth_telling.iter().map(Strength::sentence).collect();
        diagnosis.extend(setup.seen_once());
        diagnosis.extend(setup.unused.clone());
        Ok((solved, diagnosis))
    }

    /// The first solution: from the start values, or, where that has no end, from where most observations agree.
    fn first(&self, setup: &mut Setup<'_>) -> Result<Solved, NetworkError> {
        let limit = self.options.largest_inflation;
        let rejects = self.options.rejection_level.is_some();
        if !(self.robust && rejects) {
            if rejects {
                setup.screen();
            }
            match setup.solve().map_err(|error| setup.explain(error, limit)) {
                Err(error) if rejects && error.is_without_end() => {}
                solved => return solved,
            }
        }
        setup.settle()?;
        setup.solve().map_err(|error| setup.explain(error, limit))
    }

    /// The weakest combination, where it is strong enough.
    fn strong(&self, setup: &Setup<'_>, solved: &Solved) -> Result<Option<Strength>, NetworkError> {
        match setup.strength(solved)? {
            Some(strength) if strength.inflation > self.options.largest_inflation => Err(strength.error()),
            strength => Ok(strength),
        }
    }

    pub(crate) fn setup<'n>(
        &self,
        network: &'n Network,
        terms: &BTreeSet<String>,
        ranged: Vec<bool>,
        passive: bool,
        datum: Datum,
    ) -> Result<Setup<'n>> {
        if passive && network.passive.as_ref().is_none_or(|passive| passive.image_points.is_empty()) {
            return Err(self.needs("the image points of a passive camera"));
        }
        let setup = Setup::from_network(network, terms.clone(), ranged, passive, datum)?;
        Ok(Setup { term_sigmas: self.options.terms.sigmas(network), ..setup })
    }

    /// Sightings whose ranges take part in a second step.
    fn ranged_sightings(&self, usable: impl Fn(usize) -> bool) -> Result<Vec<usize>> {
        let ranged = ranged_stations(self.network, self.options);
        let sightings = self.network.sightings.iter().enumerate();
        let chosen = sightings.filter(|(_, s)| s.range_m.is_some() && ranged[s.station] && usable(s.target));
        let chosen: Vec<usize> = chosen.map(|(index, _)| index).collect();
        if chosen.is_empty() { Err(self.needs("ranges")) } else { Ok(chosen) }
    }

    /// That the method, or what it is to estimate, needs something.
    pub(crate) fn needs(&self, needs: &str) -> Error {
        Error::MethodNeeds { method: self.options.method.name().to_owned(), needs: format!("it needs {needs}") }
    }

    fn require_known_targets(&self) -> Result<()> {
        let seen: BTreeSet<usize> = self.network.sightings.iter().map(|seen| seen.target).collect();
        let unknown: Vec<&str> = seen
            .into_iter()
            .filter(|&target| {
                let target = &self.network.targets[target];
                target.point.is_none() || target.covariance.is_none()
            })
            .map(|target| self.network.targets[target].name.as_str())
            .collect();
        if unknown.is_empty() {
            return Ok(());
        }
        Err(self.needs(&format!(
            "known coordinates, with standard deviations, of the targets of the range network; {} have none",
            unknown.join(", ")
        )))
    }
}

/// The estimated camera parameters of an adjustment as a prior of the next one.
fn camera_prior(setup: &Setup<'_>, solved: &Solved) -> Result<Option<BlockPrior>> {
    let parameters = setup.estimated_parameters(solved);
    let own: Vec<_> = parameters.iter().filter(|(_, block, _)| *block == solved.blocks.camera).collect();
    if own.is_empty() {
        return Ok(None);
    }
    let values = camera_values(&setup.calibration_found(solved)?.camera);
    let places: Vec<_> = own.iter().map(|(_, block, component)| (*block, *component)).collect();
    let covariance = covariance_of(&solved.solution, &places)?;
    let known = places.iter().map(|(_, component)| (*component, values[*component])).collect();
    Ok(Some(BlockPrior { known, covariance }))
}
