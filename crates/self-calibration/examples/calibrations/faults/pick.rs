//! Which values are spoilt, and words for what should be said of them.

use self_calibration::{CauseKind, Network};

use super::Expected;

/// Approximate coordinates do not enter the result; control does.
pub fn of_coordinates(network: &Network, expected: Expected) -> Expected {
    if network.targets.iter().any(|target| target.covariance.is_some()) { expected } else { Expected::Unharmed }
}

pub fn coprime(a: usize, b: usize) -> bool {
    if b == 0 { a == 1 } else { coprime(b, a % b) }
}

pub fn mirrored() -> Expected {
    let kinds = vec![CauseKind::Mirrored, CauseKind::CoordinateAxes, CauseKind::ColumnsExchanged];
    Expected::Refused(kinds, None)
}

pub fn chosen(network: &Network, pick: usize, suits: impl Fn(Option<f64>) -> bool) -> usize {
    let all: Vec<usize> =
        (0..network.sightings.len()).filter(|&index| suits(network.sightings[index].range_m)).collect();
    all[(pick * 7919 + 31) % all.len()]
}

/// Two sightings of one station that lie at least 15 pixels apart.
pub fn pair(network: &Network, pick: usize) -> (usize, usize) {
    let one = chosen(network, pick, |_| true);
    let [col, row] = network.sightings[one].pixel.unwrap();
    let apart = |index: &usize| {
        let [other_col, other_row] = network.sightings[*index].pixel.unwrap();
        (col - other_col).hypot(row - other_row) > 15.0
    };
    let station = network.sightings[one].station;
    let others = (0..network.sightings.len()).filter(|&index| network.sightings[index].station == station);
    let others: Vec<usize> = others.filter(apart).collect();
    (one, others[pick % others.len()])
}

pub fn rejected(network: &Network, sightings: &[usize]) -> Expected {
    let seen: Vec<_> = sightings.iter().map(|&index| network.sightings[index]).collect();
    let targets = seen.iter().map(|seen| network.targets[seen.target].name.clone()).collect();
    Expected::Rejected(network.stations[seen[0].station].name.clone(), targets)
}

pub fn ranged_station(network: &Network, pick: usize) -> usize {
    let has = |station: &usize| network.sightings.iter().any(|seen| seen.station == *station && seen.range_m.is_some());
    let all: Vec<usize> = (0..network.stations.len()).filter(has).collect();
    all[pick % all.len()]
}

pub fn ranges(network: &mut Network, change: impl Fn(f64) -> f64) {
    network.sightings.iter_mut().for_each(|seen| seen.range_m = seen.range_m.map(&change));
}

pub fn ranges_of_a_station(
    network: &mut Network,
    pick: usize,
    every: usize,
    change: fn(f64) -> f64,
    kind: CauseKind,
) -> Expected {
    let station = ranged_station(network, pick);
    let own = network.sightings.iter_mut().filter(|seen| seen.station == station);
    own.step_by(every).for_each(|seen| seen.range_m = seen.range_m.map(change));
    Expected::Refused(vec![kind], Some(network.stations[station].name.clone()))
}

pub fn depths(network: &mut Network, which: impl Fn(usize) -> bool) {
    let camera = network.camera;
    for seen in network.sightings.iter_mut().filter(|seen| which(seen.station)) {
        let along = -camera.ray(seen.pixel.unwrap()).z;
        seen.range_m = seen.range_m.map(|range| range * along);
    }
}

pub fn refused(network: &Network, kind: CauseKind, station: usize) -> Expected {
    Expected::Refused(vec![kind], Some(network.stations[station].name.clone()))
}
