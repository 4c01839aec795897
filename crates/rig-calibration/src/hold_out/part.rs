//! A part of what the cameras of a rig observed, with the epochs and targets that it determines.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Point3};
use self_calibration::{
    CalibrationOutcome, Component, DistanceEnd, KnownDistance, Network, NetworkTarget, Sighting, Verdict,
};

use crate::RigOutcome;
use crate::names::station;
use crate::rig::{Rig, RigCamera};
use crate::selection::POINTS_OF_A_STATION;

/// Which observations take part, by the number of the camera and the name of the epoch. A range needs its image point.
#[derive(Clone, Copy)]
pub(super) struct Keep<'k> {
    pub(super) image: &'k dyn Fn(usize, &str) -> bool,
    pub(super) range: &'k dyn Fn(usize, &str) -> bool,
}

/// Networks with the same epochs and targets.
pub(super) struct Part {
    pub(super) networks: Vec<Network>,
    /// `world_from_rig`, as all observations have it.
    pub(super) epochs: Vec<Isometry3<f64>>,
    pub(super) targets: Vec<Point3<f64>>,
}

/// An observation by its names.
type Named<'a> = (&'a str, &'a str, Sighting);

/// Station and target of what a calibration rejected; a sighting goes as a whole.
pub(super) fn rejected(calibration: &CalibrationOutcome) -> BTreeSet<(&str, &str)> {
    let of = calibration.residuals.iter().filter(|quality| quality.verdict == Verdict::Rejected);
    of.map(|quality| (quality.station.as_str(), quality.target.as_str())).collect()
}

impl Part {
    pub(super) fn new(rig: &Rig, outcome: &RigOutcome, keep: &Keep<'_>) -> Self {
        let controls = controls(rig, outcome);
        let mut seen: Vec<Vec<Named<'_>>> = rig
            .cameras
            .iter()
            .zip(&outcome.cameras)
            .enumerate()
            .map(|(index, (camera, found))| sightings(index, camera, &rejected(&found.calibration), keep))
            .collect();
        let known = |name: &str| controls.contains_key(name);
        let (epochs, targets) = determined(&mut seen, outcome, &known);
        let epoch_places: BTreeMap<&str, usize> = places(epochs.iter().map(|(name, _)| *name));
        let target_places: BTreeMap<&str, usize> = places(targets.iter().map(|(name, _)| *name));
        let target = |(name, _): &(&str, Point3<f64>)| {
            let free = NetworkTarget { name: (*name).to_owned(), point: None, covariance: None };
            controls.get(name).map_or(free, |control| (*control).clone())
        };
        let all: Vec<NetworkTarget> = targets.iter().map(target).collect();
        let network = |(index, (camera, seen)): (usize, (&RigCamera, Vec<Named<'_>>))| {
            let own = &camera.network;
            let moved = |(station, target, seen): Named<'_>| Sighting {
                station: epoch_places[station],
                target: target_places[target],
                ..seen
            };
            let known = own.distances.iter().filter(|_| index == 0);
            let gone = rejected(&outcome.cameras[index].calibration);
            let mut stations: Vec<_> = epochs.iter().map(|(name, _)| station(own, name, index == 0)).collect();
            for control in stations.iter_mut().filter(|control| gone.contains(&(control.name.as_str(), ""))) {
                control.covariance = None;
            }
            Network {
                camera: own.camera,
                range_model: own.range_model.clone(),
                stations,
                targets: all.clone(),
                sightings: seen.into_iter().map(moved).collect(),
                distances: known
                    .filter(|known| !gone.contains(&(own.end_name(known.from), own.end_name(known.to))))
                    .filter_map(|known| distance(own, known, &epoch_places, &target_places))
                    .collect(),
                passive: None,
            }
        };
        Self {
            networks: rig.cameras.iter().zip(seen).enumerate().map(network).collect(),
            epochs: epochs.into_iter().map(|(_, pose)| pose).collect(),
            targets: targets.into_iter().map(|(_, point)| point).collect(),
        }
    }
}

/// Control points by their names, but those that were rejected.
fn controls<'r>(rig: &'r Rig, outcome: &RigOutcome) -> BTreeMap<&'r str, &'r NetworkTarget> {
    let all = rig.cameras.iter().flat_map(|camera| &camera.network.targets);
    let mut controls = BTreeMap::new();
    for control in all.filter(|target| target.covariance.is_some()) {
        controls.entry(control.name.as_str()).or_insert(control);
    }
    let residuals = outcome.cameras.iter().flat_map(|camera| &camera.calibration.residuals);
    for quality in residuals.filter(|q| q.verdict == Verdict::Rejected && q.component == Component::Control) {
        controls.remove(quality.target.as_str());
    }
    controls
}

fn sightings<'r>(
    index: usize,
    camera: &'r RigCamera,
    rejected: &BTreeSet<(&str, &str)>,
    keep: &Keep<'_>,
) -> Vec<Named<'r>> {
    let network = &camera.network;
    let kept = network.sightings.iter().filter_map(|seen| {
        let (epoch, target) =
            (network.stations[seen.station].name.as_str(), network.targets[seen.target].name.as_str());
        let is_kept = seen.pixel.is_some() && (keep.image)(index, epoch) && !rejected.contains(&(epoch, target));
        let range_m = seen.range_m.filter(|_| (keep.range)(index, epoch));
        is_kept.then_some((epoch, target, Sighting { range_m, ..*seen }))
    });
    kept.collect()
}

/// Takes out the sightings of epochs with fewer than four image points and of targets that nothing places; the others with their
/// places as all observations have them.
#[expect(clippy::type_complexity, reason = "names with their places")]
fn determined<'o>(
    seen: &mut [Vec<Named<'_>>],
    outcome: &'o RigOutcome,
    is_control: &dyn Fn(&str) -> bool,
) -> (Vec<(&'o str, Isometry3<f64>)>, Vec<(&'o str, Point3<f64>)>) {
    let epochs = outcome.epochs.iter().map(|epoch| (epoch.name.as_str(), epoch.world_from_camera));
    let targets = outcome.targets.iter().map(|target| (target.name.as_str(), target.point));
    let (mut epochs, mut targets): (Vec<_>, Vec<_>) = (epochs.collect(), targets.collect());
    loop {
        let (mut points, mut values) = (BTreeMap::<&str, usize>::new(), BTreeMap::<&str, usize>::new());
        for (epoch, target, seen) in seen.iter().flatten() {
            *points.entry(epoch).or_default() += 1;
            *values.entry(target).or_default() += 2 + usize::from(seen.range_m.is_some());
        }
        epochs.retain(|(name, _)| points.get(name).is_some_and(|&count| count >= POINTS_OF_A_STATION));
        targets.retain(|(name, _)| values.get(name).is_some_and(|&count| count >= 3 || is_control(name)));
        let (known, placed): (BTreeSet<&str>, BTreeSet<&str>) =
            (epochs.iter().map(|(name, _)| *name).collect(), targets.iter().map(|(name, _)| *name).collect());
        let before: usize = seen.iter().map(Vec::len).sum();
        for own in seen.iter_mut() {
            own.retain(|(epoch, target, _)| known.contains(epoch) && placed.contains(target));
        }
        if seen.iter().map(Vec::len).sum::<usize>() == before {
            return (epochs, targets);
        }
    }
}

fn places<'n>(names: impl Iterator<Item = &'n str>) -> BTreeMap<&'n str, usize> {
    names.enumerate().map(|(place, name)| (name, place)).collect()
}

fn distance(
    own: &Network,
    known: &KnownDistance,
    epochs: &BTreeMap<&str, usize>,
    targets: &BTreeMap<&str, usize>,
) -> Option<KnownDistance> {
    let moved = |end: DistanceEnd| match end {
        DistanceEnd::Station(index) => epochs.get(own.stations[index].name.as_str()).copied().map(DistanceEnd::Station),
        DistanceEnd::Target(index) => targets.get(own.targets[index].name.as_str()).copied().map(DistanceEnd::Target),
    };
    Some(KnownDistance { from: moved(known.from)?, to: moved(known.to)?, ..*known })
}
