//! Each camera by itself: start values of its calibration and poses, and what contradicts within it.

use std::collections::{BTreeMap, BTreeSet};

use calibration_network::functional_model::{Datum, Excluded, Setup, camera_names, usual_sigmas};
use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::{Isometry3, Matrix3, Point3};
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Component, Error as Cause, Method, Network, NetworkDatum, NetworkError,
    ObservationQuality, TermSelection, Verdict, calibrate,
};

use crate::rig::RigCamera;
use crate::selection::sufficient;
use crate::world::World;
use crate::{Error, Result};

/// Standard deviation with which the targets of the other cameras hold a camera that is placed among them, metre. Range
/// cameras calibrated by themselves know targets to some millimetres; these are start values, and ten times more or less
/// changes nothing but how far a wrong one may lead.
const TARGETS_KNOWN_TO_M: f64 = 2e-3;
/// Share of the image points that may be far from where the targets of the others put them. Gross errors are a few
/// percent; of a folder that belongs to another camera it is nearly all.
const MOST_MISSED: f64 = 0.5;

/// A camera with its calibration and its poses, before the adjustment of the rig.
#[derive(Debug, Clone)]
pub(crate) struct Alone {
    pub(crate) camera: Camera,
    /// Range terms by integration time.
    pub(crate) models: Vec<(Option<f64>, RangeErrorModel)>,
    /// Canonical names of the terms to estimate.
    pub(crate) estimated: BTreeSet<String>,
    /// What the automatic choice said of them.
    pub(crate) decisions: Vec<self_calibration::TermDecision>,
    /// `world_from_camera` by epoch.
    pub(crate) stations: BTreeMap<String, Isometry3<f64>>,
    pub(crate) targets: BTreeMap<String, Point3<f64>>,
    /// Positions in the camera's network.
    pub(crate) excluded: Excluded,
    /// What is to be told of it.
    pub(crate) diagnosis: Vec<String>,
}

/// A range camera calibrated by itself, in a world of its own; `None` where its network is too weak for that, with the
/// reason.
pub(crate) fn alone(camera: &RigCamera, options: &CalibrationOptions) -> Result<Result<Alone, Cause>> {
    let part = sufficient(&camera.network);
    let control = has_control(&part.network);
    let own = CalibrationOptions {
        method: Method::OneStep,
        terms: selection(camera, options),
        datum: if control { NetworkDatum::Control } else { NetworkDatum::Free },
        without_ranges: names_in(&part.network, &options.without_ranges),
        ..options.clone()
    };
    match calibrate(&part.network, &own) {
        Ok(outcome) => Ok(Ok(from_outcome(&outcome, &part.network, &part.sightings))),
        Err(error) if is_weak(&error) => Ok(Err(error)),
        Err(error) => Err(Error::of(&camera.name, error)),
    }
}

/// Whether a network may be determined with the others all the same.
fn is_weak(error: &Cause) -> bool {
    matches!(
        error,
        Cause::Network(
            NetworkError::WeakNetwork { .. } | NetworkError::TooFewSightings { .. } | NetworkError::NotReachable { .. }
        )
    )
}

pub(crate) fn has_control(network: &Network) -> bool {
    network.targets.iter().any(|target| target.covariance.is_some())
        || network.stations.iter().any(|station| station.covariance.is_some())
}

/// Those of the names that are stations of a network.
pub(crate) fn names_in(network: &Network, names: &[String]) -> Vec<String> {
    names.iter().filter(|name| network.stations.iter().any(|station| station.name == **name)).cloned().collect()
}

pub(crate) fn selection(camera: &RigCamera, options: &CalibrationOptions) -> TermSelection {
    camera.terms.as_ref().map_or_else(|| options.terms.clone(), |terms| TermSelection::List(terms.clone()))
}

fn from_outcome(outcome: &CalibrationOutcome, network: &Network, sightings: &[usize]) -> Alone {
    let plain = |name: &String| name.split('@').next().unwrap_or(name).to_owned();
    let mut excluded = Excluded::default();
    let place: BTreeMap<(&str, &str), usize> = network
        .sightings
        .iter()
        .zip(sightings)
        .map(|(seen, &index)| {
            let (station, target) = (&network.stations[seen.station].name, &network.targets[seen.target].name);
            ((station.as_str(), target.as_str()), index)
        })
        .collect();
    let rejected = outcome.residuals.iter().filter(|quality| quality.verdict == Verdict::Rejected);
    for quality in rejected {
        exclude(&mut excluded, quality, &place);
    }
    Alone {
        camera: outcome.camera,
        models: outcome.range_models.clone(),
        estimated: outcome.estimated.iter().map(plain).collect(),
        decisions: outcome.decisions.clone(),
        stations: outcome.stations.iter().map(|found| (found.name.clone(), found.world_from_camera)).collect(),
        targets: outcome.targets.iter().map(|found| (found.name.clone(), found.point)).collect(),
        excluded,
        diagnosis: outcome
            .diagnosis
            .iter()
            .chain(&outcome.doubts)
            .filter(|words| is_of_inputs(words))
            .cloned()
            .collect(),
    }
}

/// Whether a sentence is about what was given, which holds for the rig as well; others are judged anew with all cameras.
fn is_of_inputs(words: &str) -> bool {
    words.contains("contradict the observations")
}

fn exclude(excluded: &mut Excluded, quality: &ObservationQuality, place: &BTreeMap<(&str, &str), usize>) {
    let Some(&index) = place.get(&(quality.station.as_str(), quality.target.as_str())) else { return };
    match quality.component {
        Component::Col | Component::Row => excluded.image_points.insert(index),
        Component::Range => excluded.ranges.insert(index),
        _ => false,
    };
}

/// A camera placed among the targets of the others, its calibration brought to where most observations agree.
pub(crate) fn placed(camera: &RigCamera, world: &World, options: &CalibrationOptions) -> Result<Alone> {
    let mut known = camera.network.clone();
    known.distances.clear();
    for station in &mut known.stations {
        (station.world_from_camera, station.covariance) = (None, None);
    }
    for target in &mut known.targets {
        target.point = world.targets.get(&target.name).copied();
        let variance = TARGETS_KNOWN_TO_M * TARGETS_KNOWN_TO_M;
        target.covariance = target.point.map(|_| Matrix3::from_diagonal_element(variance));
    }
    let part = sufficient(&known);
    let network = &part.network;
    let placed = network.targets.iter().filter(|target| target.point.is_some()).count();
    if placed < 3 {
        return Err(Error::NotConnected { camera: camera.name.clone(), found: placed });
    }
    let estimated = terms(camera, options);
    let failed = |error: NetworkError| match error {
        NetworkError::NotReachable { .. } | NetworkError::Orientation(_) => misplaced(camera, &error.to_string()),
        error => Error::of(&camera.name, error),
    };
    let ranged = vec![true; network.stations.len()];
    let setup = Setup::from_network(network, estimated.clone(), ranged, false, Datum::Control).map_err(failed)?;
    let mut setup = Setup { term_sigmas: usual_sigmas(network), ..setup };
    let [missed_first, _] = setup.misses();
    setup.settle().map_err(failed)?;
    let [missed, _] = setup.misses();
    if missed.min(missed_first) > MOST_MISSED {
        return Err(misplaced(camera, &format!("{:.0} % of its image points are far from them", 1e2 * missed)));
    }
    let excluded = setup.excluded.clone();
    let moved = |indices: &BTreeSet<usize>| indices.iter().map(|&index| part.sightings[index]).collect();
    Ok(Alone {
        camera: setup.calibration.camera,
        models: setup.calibration.sets.iter().map(|set| (set.time, set.model.clone())).collect(),
        estimated,
        decisions: Vec::new(),
        stations: network.stations.iter().map(|s| s.name.clone()).zip(setup.start.stations.iter().copied()).collect(),
        targets: network
            .targets
            .iter()
            .zip(&setup.start.targets)
            .filter_map(|(target, point)| Some((target.name.clone(), (*point)?)))
            .collect(),
        excluded: Excluded {
            image_points: moved(&excluded.image_points),
            ranges: moved(&excluded.ranges),
            ..Excluded::default()
        },
        diagnosis: Vec::new(),
    })
}

fn misplaced(camera: &RigCamera, reason: &str) -> Error {
    let reason = format!(
        "its observations do not fit the targets of the other cameras with its calibration ({reason}); are its files those \
         of another camera, or are targets named otherwise?"
    );
    Error::NotPlaced { camera: camera.name.clone(), reason }
}

/// Terms of a camera that is not calibrated by itself.
fn terms(camera: &RigCamera, options: &CalibrationOptions) -> BTreeSet<String> {
    let lens = camera_names().into_iter().map(str::to_owned);
    let ranged = camera.has_ranges().then(|| camera.network.range_model.parameter_names());
    let mut all: BTreeSet<String> = lens.chain(ranged.into_iter().flatten()).collect();
    if let TermSelection::List(names) = selection(camera, options) {
        all.retain(|name| names.contains(name));
    }
    all
}
