//! Where nothing but image points is known: some stations oriented relative to each other.

use std::collections::BTreeMap;

use camera_model::Camera;
use nalgebra::{Isometry3, Vector3};
use orientation::{ImagePoint, NetworkOptions, OrientedNetwork, TieObservation, orient_network};

use crate::functional_model::misfit::median;
use crate::{DistanceEnd, Network};

/// Stations that are oriented at once; the others follow one by one from the targets that these place.
const MOST_STATIONS: usize = 10;
/// Image points of a station that takes part.
const FEWEST: usize = 8;
/// Standard deviations that are tried, as parts of the image's diagonal: the lens of a nominal camera leaves up to a hundredth,
/// and what is taken for noise hides the base.
const SIGMAS: [f64; 3] = [0.001, 0.003, 0.01];
/// Largest part of the image points that may contradict.
const CONTRADICTING: f64 = 0.2;

/// Poses of some stations in the frame of one of them, in metres where known distances tell the scale, else with one base
/// for the unit; or why there are none.
pub(crate) fn poses(network: &Network, camera: &Camera) -> Result<BTreeMap<usize, Isometry3<f64>>, String> {
    let seen = chosen(network);
    let (stations, targets) = (numbers(seen.iter().map(|seen| seen.0)), numbers(seen.iter().map(|seen| seen.1)));
    if stations.len() < 2 {
        return Err(format!("fewer than two stations have {FEWEST} image points"));
    }
    let diagonal = (camera.format.width as f64).hypot(camera.format.height as f64);
    let mut reason = String::new();
    for share in SIGMAS {
        let tie = |(station, target, pixel): &(usize, usize, [f64; 2])| {
            let image = ImagePoint::new(*pixel, share * diagonal);
            Some(TieObservation { station: *stations.get(station)?, target: *targets.get(target)?, image, range: None })
        };
        let ties: Vec<TieObservation> = seen.iter().filter_map(tie).collect();
        match orient_network(camera, &ties, &NetworkOptions::default()) {
            Ok(found) if found.gross_errors.len() as f64 <= CONTRADICTING * 2.0 * ties.len() as f64 => {
                let scale = scale(network, &found, &stations, &targets);
                let scaled = |index: &usize| {
                    let mut pose = found.stations.get(*index)?.first_from_station;
                    pose.translation.vector *= scale;
                    Some(pose)
                };
                return Ok(stations.iter().filter_map(|(station, index)| Some((*station, scaled(index)?))).collect());
            }
            Ok(found) => {
                reason = format!("{} of {} image coordinates contradict", found.gross_errors.len(), 2 * ties.len());
            }
            Err(error) => reason = error.to_string(),
        }
    }
    Err(reason)
}

/// Station, target and image point of the stations that take part, spread over all.
fn chosen(network: &Network) -> Vec<(usize, usize, [f64; 2])> {
    let mut counts = vec![0_usize; network.stations.len()];
    for seen in network.sightings.iter().filter(|seen| seen.pixel.is_some()) {
        counts[seen.station] += 1;
    }
    let rich: Vec<usize> = (0..counts.len()).filter(|&station| counts[station] >= FEWEST).collect();
    let every = rich.len().div_ceil(MOST_STATIONS).max(1);
    let rich: Vec<usize> = rich.into_iter().step_by(every).collect();
    let seen = network.sightings.iter().filter(|seen| rich.binary_search(&seen.station).is_ok());
    seen.filter_map(|seen| Some((seen.station, seen.target, seen.pixel?))).collect()
}

/// Each item with its place among all of them.
fn numbers(items: impl Iterator<Item = usize>) -> BTreeMap<usize, usize> {
    let all: std::collections::BTreeSet<usize> = items.collect();
    all.into_iter().enumerate().map(|(number, item)| (item, number)).collect()
}

/// Metres of the network's unit, by the known distances.
fn scale(
    network: &Network,
    found: &OrientedNetwork,
    stations: &BTreeMap<usize, usize>,
    targets: &BTreeMap<usize, usize>,
) -> f64 {
    let place = |end: DistanceEnd| -> Option<Vector3<f64>> {
        match end {
            DistanceEnd::Station(station) => {
                let found = found.stations.get(*stations.get(&station)?)?;
                Some(found.first_from_station.translation.vector)
            }
            DistanceEnd::Target(target) => Some((*found.points.get(*targets.get(&target)?)?)?.point.coords),
        }
    };
    let ratio = |known: &crate::KnownDistance| {
        let length = (place(known.from)? - place(known.to)?).norm();
        (length > 0.0).then(|| known.distance_m / length)
    };
    let ratios: Vec<f64> = network.distances.iter().filter_map(ratio).collect();
    if ratios.is_empty() { 1.0 } else { median(ratios) }
}
