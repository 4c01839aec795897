//! Ranges that are whole ambiguity intervals off: whichever they are, they are named.

use self_calibration::{CauseKind, Error, Network, Verdict, calibrate};

use crate::contradictions::networks::{INTERVAL, Sound, sound};
use crate::contradictions::suite::{is_true, options};

/// Stations with ranges.
fn ranged(network: &Network) -> Vec<usize> {
    let has = |station: &usize| network.sightings.iter().any(|seen| seen.station == *station && seen.range_m.is_some());
    (0..network.stations.len()).filter(has).collect()
}

/// Moves every range that is chosen by whole intervals.
fn moved(sound: &Sound, seed: u64, intervals: f64, chosen: impl Fn(usize, usize) -> bool) -> Network {
    let mut network = sound.observed(seed);
    for (index, seen) in network.sightings.iter_mut().enumerate().filter(|(_, seen)| seen.range_m.is_some()) {
        if chosen(index, seen.station) {
            seen.range_m = seen.range_m.map(|range| range + intervals * INTERVAL);
        }
    }
    network
}

#[test]
fn one_range_of_any_station_is_rejected_by_name() {
    for sound in sound() {
        let plain = sound.observed(11);
        for station in ranged(&plain) {
            let own = plain.sightings.iter().enumerate();
            let own: Vec<usize> =
                own.filter(|(_, seen)| seen.station == station && seen.range_m.is_some()).map(|(i, _)| i).collect();
            let wrong = own[station * 7 % own.len()];
            let network = moved(&sound, 11, if station % 3 == 2 { 2.0 } else { 1.0 }, |index, _| index == wrong);
            let place = format!("{}: station {station}, sighting {wrong}", sound.name);
            let outcome = calibrate(&network, &options(&sound)).unwrap_or_else(|error| panic!("{place}: {error}"));
            assert!(outcome.doubts.is_empty(), "{place}: {:?}", outcome.doubts);
            is_true(&outcome, &sound).unwrap_or_else(|words| panic!("{place}: {words}"));
            let names = (&network.stations[station].name, &network.targets[network.sightings[wrong].target].name);
            let named = outcome
                .residuals
                .iter()
                .any(|quality| (&quality.station, &quality.target) == names && quality.verdict == Verdict::Rejected);
            assert!(named, "{place}");
            let said = outcome.diagnosis.join("; ");
            assert!(said.contains("ambiguity interval"), "{place}: {said}");
        }
    }
}

#[test]
fn all_ranges_of_a_station_are_told() {
    // A third of the stations, in each network other ones.
    require_stations_to_be_told(|network, station| (network + station) % 3 == 0);
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn all_ranges_of_any_station_are_told() {
    require_stations_to_be_told(|_, _| true);
}

/// `chosen` says by the numbers of network and station which are tried.
fn require_stations_to_be_told(chosen: impl Fn(usize, usize) -> bool) {
    for (number, sound) in sound().into_iter().enumerate() {
        for station in ranged(&sound.observed(13)).into_iter().filter(|&station| chosen(number, station)) {
            let network = moved(&sound, 13, 1.0, |_, of| of == station);
            let place = format!("{}: station {station}", sound.name);
            match calibrate(&network, &options(&sound)) {
                Err(Error::Contradiction(found)) => {
                    let name = Some(network.stations[station].name.clone());
                    let told = |cause: &self_calibration::Cause| {
                        cause.kind == CauseKind::WholeIntervals && cause.station == name
                    };
                    assert!(found.causes.len() == 1 && found.causes.iter().all(told), "{place}: {found}");
                }
                other => panic!("{place}: {:?}", other.map(|outcome| outcome.doubts)),
            }
        }
    }
}

#[test]
fn all_ranges_are_told() {
    for sound in sound() {
        let network = moved(&sound, 15, 1.0, |_, _| true);
        match calibrate(&network, &options(&sound)) {
            Err(Error::Contradiction(found)) => {
                let told = |cause: &self_calibration::Cause| {
                    cause.kind == CauseKind::WholeIntervals && cause.station.is_none()
                };
                assert!(found.causes.len() == 1 && found.causes.iter().all(told), "{}: {found}", sound.name);
            }
            other => panic!("{}: {:?}", sound.name, other.map(|outcome| outcome.doubts)),
        }
    }
}
