//! Stations that have the same observations: noise never repeats itself.

use std::collections::BTreeMap;

use crate::findings::contradiction::{Cause, CauseKind};
use crate::{Network, Sighting};

/// Sightings that tell a copy from a coincidence, and the share of the smaller station's that must be the same: of stations
/// on one spot, image points rounded to whole pixels agree often, but not nearly all.
const FEWEST: usize = 4;
const SHARE: f64 = 0.9;

/// Stations with another's observations.
pub(super) fn copies(network: &Network) -> Vec<Cause> {
    // Same target, same image point, same range, to the last bit.
    type Key = (usize, [u64; 2], Option<u64>);
    let mut by_value: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
    let mut counts = vec![0_usize; network.stations.len()];
    let observed = |seen: &Sighting| Some((seen.target, seen.pixel?.map(f64::to_bits), seen.range_m.map(f64::to_bits)));
    for seen in &network.sightings {
        if let Some(key) = observed(seen) {
            by_value.entry(key).or_default().push(seen.station);
            counts[seen.station] += 1;
        }
    }
    let mut common: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for stations in by_value.values().filter(|stations| stations.len() > 1) {
        for (index, &one) in stations.iter().enumerate() {
            for &other in stations[index + 1..].iter().filter(|other| **other != one) {
                *common.entry((one.min(other), one.max(other))).or_default() += 1;
            }
        }
    }
    let is_copy = |(pair, same): &(&(usize, usize), &usize)| {
        let fewer = counts[pair.0].min(counts[pair.1]);
        **same >= FEWEST && **same as f64 >= SHARE * fewer as f64
    };
    common.iter().filter(is_copy).map(|(pair, same)| cause(network, *pair, *same)).collect()
}

fn cause(network: &Network, (one, other): (usize, usize), same: usize) -> Cause {
    let names = [one, other].map(|station| network.stations[station].name.clone());
    Cause {
        kind: CauseKind::DuplicateStation,
        station: None,
        words: format!(
            "stations `{}` and `{}` have {same} observations in common, to the last digit: one is a copy of the other",
            names[0], names[1]
        ),
        names: names.into(),
        remedy: "leave one of them out, or give it the observations of its own frame",
        log_odds: f64::INFINITY,
    }
}
