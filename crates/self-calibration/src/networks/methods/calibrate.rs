//! The methods of Sect. 5.3: which adjustments they consist of.

use std::collections::BTreeSet;

use crate::networks::functional_model::problem::{BlockPrior, Datum, Excluded, Setup, Solved};
use crate::networks::functional_model::terms::{camera_names, camera_values};
use crate::networks::methods::combine::{Combined, combine};
use crate::networks::methods::range_step::{RangeStep, ScaleUse};
use crate::networks::precision::quality::Geometry;
use crate::networks::precision::reference::Reference;
use crate::networks::start_values::settle::is_without_end;
use crate::networks::start_values::start::find_start;
use crate::networks::start_values::start_calibration::start_calibration;
use crate::networks::weakness::strength::Strength;
use crate::networks::{CalibrationOptions, CalibrationOutcome, Method, Network, NetworkDatum, TermSelection};
use crate::{Error, Result};

/// Inflation from which on the weakest combination is told although it is accepted.
const WORTH_TELLING: f64 = 100.0;

/// Calibrates a range camera from a network of targets.
///
/// Start values are found where there are none. Terms of a list may be words for several:
///
/// | word | terms | instead of |
/// |---|---|---|
/// | `splineN` | periodic spline with N knots over the ambiguity interval, s0 on | d2 to d7 |
/// | `polynomialN` | polynomial of order N over the observed ranges, q1 on | |
/// | `surfaceN` | surface of order N over the image, g10 on | e1, e2 |
///
/// The methods:
///
/// | method | unknown together | then |
/// |---|---|---|
/// | one step | lens, range terms, poses, targets | |
/// | two steps, dependent | lens, poses, targets from image points | range terms from the distances between the adjusted stations and targets, whose full covariance is handed on |
/// | joint, two steps | the same with the image points of a passive camera and its relative orientation | the same |
/// | joint, integrated | lens, range terms, poses, targets, relative orientation | |
/// | laboratory | range terms from known distances, or known poses and coordinates, with their deviations | |
///
/// Image points alone have no scale. Where neither control nor a known distance gives it, the second step estimates it
/// from the ranges, as one more unknown beside the range terms.
///
/// # Errors
/// Whatever is wrong with the network, by name; [`Error::WeakNetwork`] where it does not determine the parameters, with
/// what to add; [`Error::MethodNeeds`] where the method asks for something else (two networks:
/// [`calibrate_two_networks`]).
pub fn calibrate(network: &Network, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
    network.validate()?;
    options.check(network)?;
    Problem { network, lens: None, options, robust: false }.judged()
}

/// Calibrates in two independent steps: the lens from the image points of one network, the range terms from another,
/// whose stations are oriented by resection from independently known targets: coordinates with their deviations.
///
/// Lens and covariance of the first network are handed on to the resection, and the covariance of lens and poses to the
/// range terms. Targets of the second network need coordinates with a covariance. The datum
/// of the options is that of the first network. The image points of the second improve the lens as well.
///
/// # Errors
/// As [`calibrate`].
pub fn calibrate_two_networks(
    lens: &Network,
    range: &Network,
    options: &CalibrationOptions,
) -> Result<CalibrationOutcome> {
    if options.method != Method::TwoStepIndependent {
        let needs = "it takes one network; two are for the two-step independent method".to_owned();
        return Err(Error::MethodNeeds { method: options.method.name().to_owned(), needs });
    }
    lens.validate()?;
    range.validate()?;
    options.check(range)?;
    Problem { network: range, lens: Some(lens), options, robust: false }.judged()
}

impl Method {
    /// Name of the method in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::OneStep => "one step",
            Self::TwoStepIndependent => "two steps, independent",
            Self::TwoStepDependent => "two steps, dependent",
            Self::JointTwoStep => "joint, two steps",
            Self::JointIntegrated => "joint, integrated",
            Self::Laboratory => "laboratory",
        }
    }
}

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
        let mut outcome = setup.outcome(&solved, self.options)?;
        outcome.diagnosis = diagnosis;
        if self.is_listed() {
            outcome.unestimated = setup.term_scores(&solved, &outcome.groups)?;
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
        let lens_outcome = first.outcome(&solved_lens, self.options)?;
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
        let first = setup.outcome(solved, self.options)?;
        let mut unestimated = if self.is_listed() { setup.term_scores(solved, &first.groups)? } else { Vec::new() };
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
            start: crate::networks::functional_model::problem::Start {
                stations: Vec::new(),
                targets: Vec::new(),
                relative: None,
            },
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
        let first = crate::networks::methods::combine::given(&setup, self.options);
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
                return Err(strength.error());
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
        let solved = setup.solve_rejecting(first, self.options.rejection_level);
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
    fn first(&self, setup: &mut Setup<'_>) -> Result<Solved> {
        let limit = self.options.largest_inflation;
        let rejects = self.options.rejection_level.is_some();
        if !(self.robust && rejects) {
            if rejects {
                setup.screen();
            }
            match setup.solve().map_err(|error| setup.explain(error, limit)) {
                Err(error) if rejects && is_without_end(&error) => {}
                solved => return solved,
            }
        }
        setup.settle()?;
        setup.solve().map_err(|error| setup.explain(error, limit))
    }

    /// The weakest combination, where it is strong enough.
    fn strong(&self, setup: &Setup<'_>, solved: &Solved) -> Result<Option<Strength>> {
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
        network.check_coverage(&ranged, passive)?;
        let calibration = start_calibration(network);
        let (start, unused) = find_start(network, &calibration, passive)?;
        let estimated = terms.clone();
        let (excluded, camera_prior) = (Excluded::default(), None);
        let geometry_held = false;
        Ok(Setup {
            network,
            start,
            unused,
            calibration,
            estimated,
            ranged,
            passive,
            datum,
            geometry_held,
            camera_prior,
            term_sigmas: self.options.terms.sigmas(network),
            excluded,
        })
    }

    /// Sightings whose ranges take part in a second step.
    fn ranged_sightings(&self, usable: impl Fn(usize) -> bool) -> Result<Vec<usize>> {
        let ranged = ranged_stations(self.network, self.options);
        let sightings = self.network.sightings.iter().enumerate();
        let chosen = sightings.filter(|(_, s)| s.range_m.is_some() && ranged[s.station] && usable(s.target));
        let chosen: Vec<usize> = chosen.map(|(index, _)| index).collect();
        if chosen.is_empty() { Err(self.needs("ranges")) } else { Ok(chosen) }
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
    let covariance = crate::networks::precision::report::covariance_of(&solved.solution, &places)?;
    let known = places.iter().map(|(_, component)| (*component, values[*component])).collect();
    Ok(Some(BlockPrior { known, covariance }))
}

/// Stations whose ranges take part.
pub(crate) fn ranged_stations(network: &Network, options: &CalibrationOptions) -> Vec<bool> {
    network.stations.iter().map(|station| !options.without_ranges.contains(&station.name)).collect()
}

/// The datum asked for, where the network agrees.
pub(crate) fn datum(network: &Network, options: &CalibrationOptions) -> Result<Datum> {
    let targets = network.targets.iter().filter(|target| target.covariance.is_some()).map(|target| &target.name);
    let stations = network.stations.iter().filter(|station| station.covariance.is_some()).map(|station| &station.name);
    let control: Vec<&str> = targets.chain(stations).map(String::as_str).collect();
    match options.datum {
        NetworkDatum::Free if control.is_empty() => Ok(Datum::Inner),
        NetworkDatum::Free => Err(Error::Datum {
            reason: format!(
                "a free network takes its datum from inner constraints, but {} {} standard deviations as control; \
                 ask for the datum `control`, or leave the standard deviations out",
                control.join(", "),
                if control.len() == 1 { "has" } else { "have" },
            ),
        }),
        NetworkDatum::Control if control.is_empty() => Err(Error::Datum {
            reason: "control was asked for, but no target and no station has standard deviations".to_owned(),
        }),
        NetworkDatum::Control => Ok(Datum::Control),
    }
}

impl Default for CalibrationOptions {
    /// One step, automatic terms, free network, all ranges, rejection at 0.0001 (of three thousand sound values, one in three surveys loses one), inflation up to 500.
    fn default() -> Self {
        Self {
            method: Method::OneStep,
            terms: TermSelection::Auto,
            datum: NetworkDatum::Free,
            without_ranges: Vec::new(),
            rejection_level: Some(1e-4),
            // Networks of stations at many distances stay below 100, with the wave of length U below 250; twelve stations
            // at one distance have 4e5. Whatever is not in the model grows by the inflation as well: at 500 a hundredth of
            // a millimetre becomes half a centimetre.
            largest_inflation: 500.0,
        }
    }
}
