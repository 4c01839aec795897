//! What is wrong with all observations of one station.

use self_calibration::{CauseKind, Network, Sighting, Station};

use super::super::networks::INTERVAL;
use super::pick::{depths, ranged_station, ranges_of_a_station, refused};
use super::{Expected, Fault};

pub fn all() -> Vec<Fault> {
    vec![
        Fault::new("ranges of a station an interval too long", |network, pick| {
            ranges_of_a_station(network, pick, 1, |range| range + INTERVAL, CauseKind::WholeIntervals)
        }),
        Fault::new("half the ranges of a station an interval too long", |network, pick| {
            ranges_of_a_station(network, pick, 2, |range| range + INTERVAL, CauseKind::WholeIntervals)
        }),
        Fault::new("ranges of a station in millimetres", |network, pick| {
            ranges_of_a_station(network, pick, 1, |range| range * 1e3, CauseKind::RangeUnit)
        }),
        Fault::new("depths for ranges at a station", |network, pick| {
            let station = ranged_station(network, pick);
            depths(network, |seen| seen == station);
            Expected::Refused(vec![CauseKind::DepthForRange], Some(network.stations[station].name.clone()))
        }),
        Fault::new("targets of a station shifted by one row", |network, pick| {
            let station = pick % network.stations.len();
            let own: Vec<usize> =
                (0..network.sightings.len()).filter(|&i| network.sightings[i].station == station).collect();
            let targets: Vec<usize> = own.iter().map(|&index| network.sightings[index].target).collect();
            for (position, &index) in own.iter().enumerate() {
                network.sightings[index].target = targets[(position + 1) % own.len()];
            }
            Expected::Refused(vec![CauseKind::LabelsShifted], Some(network.stations[station].name.clone()))
        }),
        Fault::new("rows of a station flipped", |network, pick| {
            let station = pick % network.stations.len();
            for seen in network.sightings.iter_mut().filter(|seen| seen.station == station) {
                seen.pixel.as_mut().unwrap()[1] = 143.0 - seen.pixel.unwrap()[1];
            }
            Expected::Refused(vec![CauseKind::Mirrored], Some(network.stations[station].name.clone()))
        }),
        Fault::new("targets of a station shifted by one name", |network, pick| {
            let station = pick % network.stations.len();
            let count = network.targets.len();
            for seen in network.sightings.iter_mut().filter(|seen| seen.station == station) {
                seen.target = (seen.target + 1) % count;
            }
            refused(network, CauseKind::LabelsShifted, station)
        }),
        Fault::new("columns of a station mirrored", |network, pick| {
            let station = (pick + 3) % network.stations.len();
            for seen in network.sightings.iter_mut().filter(|seen| seen.station == station) {
                seen.pixel = seen.pixel.map(|[col, row]| [175.0 - col, row]);
            }
            refused(network, CauseKind::Mirrored, station)
        }),
        Fault::new("columns and rows of a station exchanged", |network, pick| {
            let station = (pick + 1) % network.stations.len();
            // What the image would not hold is no image point then.
            network.sightings.retain(|seen| seen.station != station || seen.pixel.unwrap()[0] <= 143.0);
            for seen in network.sightings.iter_mut().filter(|seen| seen.station == station) {
                seen.pixel.as_mut().unwrap().swap(0, 1);
            }
            refused(network, CauseKind::ColumnsExchanged, station)
        }),
        Fault::new("ranges of a station by another frequency", |network, pick| {
            ranges_of_a_station(network, pick, 1, |range| range * 20.0 / 30.0, CauseKind::ModulationFrequency)
        }),
        Fault::new("ranges of a station in centimetres", |network, pick| {
            ranges_of_a_station(network, pick, 1, |range| range * 1e2, CauseKind::RangeUnit)
        }),
        Fault::new("a copy of a station", |network, pick| {
            let station = pick % network.stations.len();
            let copy = Station { name: "COPY".to_owned(), ..network.stations[station].clone() };
            network.stations.push(copy);
            repeated(network, station, network.stations.len() - 1)
        }),
        Fault::new("a station with the frame of another", |network, pick| {
            let (station, other) = (pick % network.stations.len(), (pick + 2) % network.stations.len());
            network.sightings.retain(|seen| seen.station != other);
            repeated(network, station, other)
        }),
    ]
}

/// Gives the sightings of a station to another as well.
fn repeated(network: &mut Network, station: usize, other: usize) -> Expected {
    let own = network.sightings.iter().filter(|seen| seen.station == station);
    let copied: Vec<Sighting> = own.map(|seen| Sighting { station: other, ..*seen }).collect();
    network.sightings.extend(copied);
    let names = [station, other].map(|index| network.stations[index].name.clone());
    Expected::Told(vec![CauseKind::DuplicateStation], names.into())
}
