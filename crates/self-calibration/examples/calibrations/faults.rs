//! What goes wrong with the tables of a network, each done to a sound one.

use camera_model::{euler_from_pose, pose_from_euler};
use nalgebra::Vector3;
use self_calibration::{CauseKind, Network};

use super::networks::INTERVAL;

/// What the calibration of a broken network should say.
#[derive(Debug, Clone, PartialEq)]
pub enum Expected {
    /// The result stands, these values are rejected: station and targets.
    Rejected(String, Vec<String>),
    /// It is refused, with this cause, of this station or of all.
    Refused(Vec<CauseKind>, Option<String>),
    /// It is refused without a cause: nothing known explains it.
    Unexplained,
    /// It is refused before anything is computed.
    OutsideImage,
    /// The result stands: what is wrong does not enter it.
    Unharmed,
}

/// A fault: name and what it does, with a number that chooses station and rows.
pub struct Fault {
    pub name: &'static str,
    pub spoil: fn(&mut Network, usize) -> Expected,
}

/// Every fault of the suite.
#[allow(clippy::too_many_lines)] // A table.
pub fn all() -> Vec<Fault> {
    let fault = |name, spoil| Fault { name, spoil };
    vec![
        fault("image point off by 100 pixels", |network, pick| {
            let index = chosen(network, pick, |_| true);
            let width = network.camera.format.width as f64;
            let pixel = network.sightings[index].pixel.as_mut().unwrap();
            pixel[0] += if pixel[0] + 100.0 < width - 1.0 { 100.0 } else { -100.0 };
            if pixel[0] < 0.0 {
                pixel[0] += 200.0 - 60.0;
            }
            rejected(network, &[index])
        }),
        fault("image point outside the image", |network, pick| {
            let index = chosen(network, pick, |_| true);
            network.sightings[index].pixel.as_mut().unwrap()[pick % 2] = 180.0 + pick as f64;
            Expected::OutsideImage
        }),
        fault("range one interval too long", |network, pick| {
            let index = chosen(network, pick, |range| range.is_some());
            *network.sightings[index].range_m.as_mut().unwrap() += INTERVAL;
            rejected(network, &[index])
        }),
        fault("range in millimetres", |network, pick| {
            let index = chosen(network, pick, |range| range.is_some());
            *network.sightings[index].range_m.as_mut().unwrap() *= 1e3;
            rejected(network, &[index])
        }),
        fault("two names exchanged", |network, pick| {
            let (one, other) = pair(network, pick);
            let target = network.sightings[one].target;
            network.sightings[one].target = network.sightings[other].target;
            network.sightings[other].target = target;
            rejected(network, &[one, other])
        }),
        fault("ranges of a station an interval too long", |network, pick| {
            ranges_of_a_station(network, pick, 1, |range| range + INTERVAL, CauseKind::WholeIntervals)
        }),
        fault("half the ranges of a station an interval too long", |network, pick| {
            ranges_of_a_station(network, pick, 2, |range| range + INTERVAL, CauseKind::WholeIntervals)
        }),
        fault("ranges of a station in millimetres", |network, pick| {
            ranges_of_a_station(network, pick, 1, |range| range * 1e3, CauseKind::RangeUnit)
        }),
        fault("depths for ranges at a station", |network, pick| {
            let station = ranged_station(network, pick);
            depths(network, |seen| seen == station);
            Expected::Refused(vec![CauseKind::DepthForRange], Some(network.stations[station].name.clone()))
        }),
        fault("targets of a station shifted by one row", |network, pick| {
            let station = pick % network.stations.len();
            let own: Vec<usize> =
                (0..network.sightings.len()).filter(|&i| network.sightings[i].station == station).collect();
            let targets: Vec<usize> = own.iter().map(|&index| network.sightings[index].target).collect();
            for (position, &index) in own.iter().enumerate() {
                network.sightings[index].target = targets[(position + 1) % own.len()];
            }
            Expected::Refused(vec![CauseKind::LabelsShifted], Some(network.stations[station].name.clone()))
        }),
        fault("rows of a station flipped", |network, pick| {
            let station = pick % network.stations.len();
            for seen in network.sightings.iter_mut().filter(|seen| seen.station == station) {
                seen.pixel.as_mut().unwrap()[1] = 143.0 - seen.pixel.unwrap()[1];
            }
            Expected::Refused(vec![CauseKind::Mirrored], Some(network.stations[station].name.clone()))
        }),
        fault("targets of all stations in another order", |network, pick| {
            for station in 0..network.stations.len() {
                let own: Vec<usize> =
                    (0..network.sightings.len()).filter(|&i| network.sightings[i].station == station).collect();
                let targets: Vec<usize> = own.iter().map(|&index| network.sightings[index].target).collect();
                let first = pick + 5 * own.len() / 13;
                let step = (first..=first + own.len()).find(|step| coprime(*step, own.len())).unwrap_or(1);
                for (position, &index) in own.iter().enumerate() {
                    network.sightings[index].target = targets[(position * step + station) % own.len()];
                }
            }
            Expected::Unexplained
        }),
        fault("all ranges in millimetres", |network, _| {
            ranges(network, |range| range * 1e3);
            Expected::Refused(vec![CauseKind::RangeUnit], None)
        }),
        fault("all ranges an interval too long", |network, _| {
            ranges(network, |range| range + INTERVAL);
            Expected::Refused(vec![CauseKind::WholeIntervals], None)
        }),
        fault("depths for all ranges", |network, _| {
            depths(network, |_| true);
            Expected::Refused(vec![CauseKind::DepthForRange], None)
        }),
        fault("columns and rows exchanged", |network, _| {
            for seen in &mut network.sightings {
                seen.pixel.as_mut().unwrap().swap(0, 1);
            }
            let outside = network.sightings.iter().any(|seen| seen.pixel.unwrap()[1] > 144.0);
            if outside { Expected::OutsideImage } else { mirrored() }
        }),
        fault("rows flipped", |network, _| {
            network
                .sightings
                .iter_mut()
                .for_each(|seen| seen.pixel.as_mut().unwrap()[1] = 143.0 - seen.pixel.unwrap()[1]);
            mirrored()
        }),
        fault("columns mirrored", |network, _| {
            network
                .sightings
                .iter_mut()
                .for_each(|seen| seen.pixel.as_mut().unwrap()[0] = 175.0 - seen.pixel.unwrap()[0]);
            mirrored()
        }),
        fault("x and y of the targets exchanged", |network, _| {
            for target in &mut network.targets {
                let point = target.point.as_mut().unwrap();
                (point.x, point.y) = (point.y, point.x);
            }
            // Even approximate ones tell which of two mirror images is meant.
            mirrored()
        }),
        fault("targets in millimetres", |network, _| {
            for target in &mut network.targets {
                target.point.as_mut().unwrap().coords *= 1e3;
            }
            of_coordinates(network, Expected::Refused(vec![CauseKind::CoordinateUnit], None))
        }),
        fault("principal distance times 1000", |network, _| {
            network.camera.interior.principal_distance_mm *= 1e3;
            Expected::Refused(vec![CauseKind::PrincipalDistanceUnit], None)
        }),
        fault("pixel pitch in micrometres", |network, _| {
            network.camera.format.pixel_pitch_mm = network.camera.format.pixel_pitch_mm.map(|pitch| 1e3 * pitch);
            Expected::Refused(vec![CauseKind::PrincipalDistanceUnit], None)
        }),
        fault("sigmas of image points in another unit", |network, _| {
            network.sightings.iter_mut().for_each(|seen| seen.sigma_pixel = seen.sigma_pixel.map(|sigma| 1e-3 * sigma));
            Expected::Refused(vec![CauseKind::SigmaUnit], None)
        }),
        fault("sigmas of ranges in another unit", |network, _| {
            network.sightings.iter_mut().for_each(|seen| seen.sigma_range_m *= 1e-3);
            Expected::Refused(vec![CauseKind::SigmaUnit], None)
        }),
        fault("radians for degrees in stations.csv", |network, _| {
            for station in &mut network.stations {
                let pose = station.world_from_camera.unwrap();
                // The number of radians, read as degrees.
                let misread = euler_from_pose(&pose).map(f64::to_radians);
                station.world_from_camera = Some(pose_from_euler(pose.translation.vector, misread));
            }
            Expected::Unharmed
        }),
        fault("stations with the wrong poses", |network, _| {
            let poses: Vec<_> = network.stations.iter().map(|station| station.world_from_camera).collect();
            for (index, station) in network.stations.iter_mut().enumerate() {
                station.world_from_camera = poses[(index + 5) % poses.len()];
                station.world_from_camera.as_mut().unwrap().translation.vector += Vector3::new(0.5, 0.0, 0.0);
            }
            Expected::Unharmed
        }),
    ]
}

/// Approximate coordinates do not enter the result; control does.
fn of_coordinates(network: &Network, expected: Expected) -> Expected {
    if network.targets.iter().any(|target| target.covariance.is_some()) { expected } else { Expected::Unharmed }
}

fn coprime(a: usize, b: usize) -> bool {
    if b == 0 { a == 1 } else { coprime(b, a % b) }
}

fn mirrored() -> Expected {
    let kinds = vec![CauseKind::Mirrored, CauseKind::CoordinateAxes, CauseKind::ColumnsExchanged];
    Expected::Refused(kinds, None)
}

fn chosen(network: &Network, pick: usize, suits: impl Fn(Option<f64>) -> bool) -> usize {
    let all: Vec<usize> =
        (0..network.sightings.len()).filter(|&index| suits(network.sightings[index].range_m)).collect();
    all[(pick * 7919 + 31) % all.len()]
}

/// Two sightings of one station that lie at least 15 pixels apart.
fn pair(network: &Network, pick: usize) -> (usize, usize) {
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

fn rejected(network: &Network, sightings: &[usize]) -> Expected {
    let seen: Vec<_> = sightings.iter().map(|&index| network.sightings[index]).collect();
    let targets = seen.iter().map(|seen| network.targets[seen.target].name.clone()).collect();
    Expected::Rejected(network.stations[seen[0].station].name.clone(), targets)
}

fn ranged_station(network: &Network, pick: usize) -> usize {
    let has = |station: &usize| network.sightings.iter().any(|seen| seen.station == *station && seen.range_m.is_some());
    let all: Vec<usize> = (0..network.stations.len()).filter(has).collect();
    all[pick % all.len()]
}

fn ranges(network: &mut Network, change: impl Fn(f64) -> f64) {
    network.sightings.iter_mut().for_each(|seen| seen.range_m = seen.range_m.map(&change));
}

fn ranges_of_a_station(
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

fn depths(network: &mut Network, which: impl Fn(usize) -> bool) {
    let camera = network.camera;
    for seen in network.sightings.iter_mut().filter(|seen| which(seen.station)) {
        let along = -camera.ray(seen.pixel.unwrap()).z;
        seen.range_m = seen.range_m.map(|range| range * along);
    }
}
