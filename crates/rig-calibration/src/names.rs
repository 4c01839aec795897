//! The networks of all cameras by names: the same stations and targets for each.

use std::collections::BTreeMap;

use calibration_network::functional_model::Excluded;
use nalgebra::{Isometry3, Point3, Vector3};
use orientation::intersect_rays;
use self_calibration::{DistanceEnd, KnownDistance, Network, NetworkTarget, Sighting, Station};

use crate::alone::Alone;
use crate::mountings::Mountings;
use crate::rig::{Rig, RigCamera};
use crate::world::World;

/// Networks whose stations are the epochs of the rig, and whose targets are those of all cameras.
#[derive(Debug)]
pub(crate) struct Joined {
    pub(crate) networks: Vec<Network>,
    /// What each camera was found to have grossly wrong, by itself.
    pub(crate) excluded: Vec<Excluded>,
    /// `world_from_rig` of each epoch.
    pub(crate) epochs: Vec<Isometry3<f64>>,
    /// Place of each target.
    pub(crate) targets: Vec<Option<Point3<f64>>>,
    /// What is left out, in sentences.
    pub(crate) left_out: Vec<String>,
}

/// Epochs and targets by name, in the order in which the cameras name them.
struct Names {
    epochs: Vec<String>,
    targets: Vec<NetworkTarget>,
    epoch_places: BTreeMap<String, usize>,
    target_places: BTreeMap<String, usize>,
}

impl Joined {
    pub(crate) fn new(rig: &Rig, alone: &[Alone], mountings: &Mountings, world: &World) -> Self {
        let mut places = world.targets.clone();
        place_others(rig, alone, mountings, &mut places);
        let names = Names::new(rig, mountings, &places);
        let mut joined = Self {
            networks: Vec::new(),
            excluded: Vec::new(),
            epochs: names.epochs.iter().map(|name| mountings.epochs[name]).collect(),
            targets: names.targets.iter().map(|target| places.get(&target.name).copied()).collect(),
            left_out: names.left_out(rig),
        };
        for (index, (camera, alone)) in rig.cameras.iter().zip(alone).enumerate() {
            let (network, excluded) = names.network(camera, alone, index == 0);
            joined.networks.push(network);
            joined.excluded.push(excluded);
        }
        joined
    }
}

/// Perspective centre and direction.
type Ray = (Vector3<f64>, Vector3<f64>);

/// Places targets that no camera placed by itself: by ranges, or where rays of all cameras meet.
fn place_others(rig: &Rig, alone: &[Alone], mountings: &Mountings, places: &mut BTreeMap<String, Point3<f64>>) {
    let mut rays: BTreeMap<&str, Vec<Ray>> = BTreeMap::new();
    let mut points: BTreeMap<&str, Point3<f64>> = BTreeMap::new();
    for ((camera, alone), mounting) in rig.cameras.iter().zip(alone).zip(&mountings.cameras) {
        let network = &camera.network;
        for seen in &network.sightings {
            let name = network.targets[seen.target].name.as_str();
            let epoch = mountings.epochs.get(&network.stations[seen.station].name);
            let (Some(epoch), Some(pixel), false) = (epoch, seen.pixel, places.contains_key(name)) else { continue };
            let pose = epoch * mounting;
            rays.entry(name).or_default().push((pose.translation.vector, pose * alone.camera.ray(pixel)));
            if let Some(range_m) = seen.range_m {
                points.entry(name).or_insert_with(|| pose * alone.camera.point(pixel, range_m));
            }
        }
    }
    for (name, rays) in rays {
        if let Some(point) = intersect_rays(&rays).or_else(|| points.get(name).copied()) {
            places.insert(name.to_owned(), point);
        }
    }
}

impl Names {
    fn new(rig: &Rig, mountings: &Mountings, places: &BTreeMap<String, Point3<f64>>) -> Self {
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        for camera in &rig.cameras {
            for seen in &camera.network.sightings {
                let values = 2 * usize::from(seen.pixel.is_some()) + usize::from(seen.range_m.is_some());
                *known.entry(camera.network.targets[seen.target].name.as_str()).or_default() += values;
            }
        }
        let mut names = Self {
            epochs: Vec::new(),
            targets: Vec::new(),
            epoch_places: BTreeMap::new(),
            target_places: BTreeMap::new(),
        };
        for network in rig.cameras.iter().map(|camera| &camera.network) {
            for station in &network.stations {
                if mountings.epochs.contains_key(&station.name) && !names.epoch_places.contains_key(&station.name) {
                    names.epoch_places.insert(station.name.clone(), names.epochs.len());
                    names.epochs.push(station.name.clone());
                }
            }
            for target in &network.targets {
                let is_determined =
                    known.get(target.name.as_str()).is_some_and(|&known| known >= 3 || target.covariance.is_some());
                if places.contains_key(&target.name) && is_determined {
                    names.add_target(target);
                }
            }
        }
        names
    }

    /// Control of a target may stand with any camera.
    fn add_target(&mut self, target: &NetworkTarget) {
        if let Some(&place) = self.target_places.get(&target.name) {
            let known = &mut self.targets[place];
            if known.covariance.is_none() && target.covariance.is_some() || known.point.is_none() {
                *known = target.clone();
            }
            return;
        }
        self.target_places.insert(target.name.clone(), self.targets.len());
        self.targets.push(target.clone());
    }

    /// What of the rig is not here.
    fn left_out(&self, rig: &Rig) -> Vec<String> {
        let mut out = Vec::new();
        for camera in &rig.cameras {
            let network = &camera.network;
            let open: Vec<&str> =
                camera.epochs().into_iter().filter(|name| !self.epoch_places.contains_key(*name)).collect();
            if !open.is_empty() {
                out.push(format!(
                    "camera `{}`: stations {} are left out: nothing orients the rig there (four targets in one camera do)",
                    camera.name,
                    open.join(", ")
                ));
            }
            let open: Vec<&str> = network
                .targets
                .iter()
                .map(|target| target.name.as_str())
                .filter(|name| !self.target_places.contains_key(*name))
                .collect();
            if !open.is_empty() {
                out.push(format!(
                    "camera `{}`: targets {} are left out: nothing places them",
                    camera.name,
                    open.join(", ")
                ));
            }
        }
        out
    }

    /// The network of a camera; the first one has known distances and control poses.
    fn network(&self, camera: &RigCamera, alone: &Alone, is_first: bool) -> (Network, Excluded) {
        let own = &camera.network;
        let mut excluded = Excluded::default();
        let mut sightings: Vec<Sighting> = Vec::with_capacity(own.sightings.len());
        for (index, seen) in own.sightings.iter().enumerate() {
            let station = self.epoch_places.get(&own.stations[seen.station].name);
            let target = self.target_places.get(&own.targets[seen.target].name);
            let (Some(&station), Some(&target)) = (station, target) else { continue };
            if alone.excluded.image_points.contains(&index) {
                excluded.image_points.insert(sightings.len());
            }
            if alone.excluded.ranges.contains(&index) {
                excluded.ranges.insert(sightings.len());
            }
            sightings.push(Sighting { station, target, ..*seen });
        }
        let network = Network {
            camera: own.camera,
            range_model: alone.models.first().map_or_else(|| own.range_model.clone(), |(_, model)| model.clone()),
            stations: self.epochs.iter().map(|name| station(own, name, is_first)).collect(),
            targets: self.targets.clone(),
            sightings,
            distances: if is_first {
                own.distances.iter().filter_map(|known| self.distance(own, known)).collect()
            } else {
                Vec::new()
            },
            passive: None,
        };
        (network, excluded)
    }

    fn distance(&self, own: &Network, known: &KnownDistance) -> Option<KnownDistance> {
        let moved = |end: DistanceEnd| match end {
            DistanceEnd::Station(station) => {
                self.epoch_places.get(&own.stations[station].name).map(|i| DistanceEnd::Station(*i))
            }
            DistanceEnd::Target(target) => {
                self.target_places.get(&own.targets[target].name).map(|i| DistanceEnd::Target(*i))
            }
        };
        Some(KnownDistance { from: moved(known.from)?, to: moved(known.to)?, ..*known })
    }
}

/// A station of the rig as a camera has it. One that it was not exposed at has an integration time of others, so that no
/// range terms of their own belong to it.
pub(crate) fn station(own: &Network, name: &str, is_first: bool) -> Station {
    let seen = own.sightings.first().map(|seen| &own.stations[seen.station]);
    let absent = Station {
        name: name.to_owned(),
        world_from_camera: None,
        covariance: None,
        integration_time_s: seen.and_then(|station| station.integration_time_s),
        drift_m: 0.0,
    };
    let Some(known) = own.stations.iter().find(|station| station.name == name) else { return absent };
    let control = known.covariance.filter(|_| is_first);
    Station {
        world_from_camera: known.world_from_camera.filter(|_| control.is_some()),
        covariance: control,
        ..known.clone()
    }
}
