//! Parts of a network.

use std::collections::BTreeMap;

use self_calibration::{DistanceEnd, KnownDistance, Network};

/// Image points that orient a station with one left to choose between solutions.
pub(crate) const POINTS_OF_A_STATION: usize = 4;

/// A part of a network, with the positions of its sightings in the whole.
pub(crate) struct Part {
    pub(crate) network: Network,
    pub(crate) sightings: Vec<usize>,
}

/// The sightings that determine stations and targets by themselves: stations of four image points and more, and targets
/// that two image points, a range or a control point place.
pub(crate) fn sufficient(network: &Network) -> Part {
    let mut kept: Vec<usize> =
        (0..network.sightings.len()).filter(|&index| network.sightings[index].pixel.is_some()).collect();
    loop {
        let mut points = vec![0_usize; network.stations.len()];
        let mut known = vec![0_usize; network.targets.len()];
        for &index in &kept {
            let seen = &network.sightings[index];
            points[seen.station] += 1;
            known[seen.target] += 2 + usize::from(seen.range_m.is_some());
        }
        let before = kept.len();
        kept.retain(|&index| {
            let seen = &network.sightings[index];
            let placed = known[seen.target] >= 3 || network.targets[seen.target].covariance.is_some();
            points[seen.station] >= POINTS_OF_A_STATION && placed
        });
        if kept.len() == before {
            return part(network, kept);
        }
    }
}

/// The network of some of the sightings, with the stations and targets that these name.
fn part(network: &Network, sightings: Vec<usize>) -> Part {
    let (mut stations, mut targets) = (BTreeMap::new(), BTreeMap::new());
    for &index in &sightings {
        stations.insert(network.sightings[index].station, 0);
        targets.insert(network.sightings[index].target, 0);
    }
    stations.values_mut().enumerate().for_each(|(position, place)| *place = position);
    targets.values_mut().enumerate().for_each(|(position, place)| *place = position);
    let moved = |end: DistanceEnd| match end {
        DistanceEnd::Station(station) => stations.get(&station).map(|place| DistanceEnd::Station(*place)),
        DistanceEnd::Target(target) => targets.get(&target).map(|place| DistanceEnd::Target(*place)),
    };
    let distance =
        |known: &KnownDistance| Some(KnownDistance { from: moved(known.from)?, to: moved(known.to)?, ..*known });
    let sighting = |&index: &usize| {
        let seen = network.sightings[index];
        self_calibration::Sighting { station: stations[&seen.station], target: targets[&seen.target], ..seen }
    };
    let network = Network {
        camera: network.camera,
        range_model: network.range_model.clone(),
        stations: stations.keys().map(|&station| network.stations[station].clone()).collect(),
        targets: targets.keys().map(|&target| network.targets[target].clone()).collect(),
        sightings: sightings.iter().map(sighting).collect(),
        distances: network.distances.iter().filter_map(distance).collect(),
        passive: None,
    };
    Part { network, sightings }
}
