//! Start values: poses and coordinates from whatever is known, gross errors among the observations or not.

use camera_model::{euler_from_pose, pose_from_euler};
use nalgebra::{Isometry3, Point3};
use orientation::TargetObservation;

use super::misfit::{Misfit, corrected_range, median, misfits};
use super::problem::{Calibration, Start};
use super::robust_pose::{NEEDED, intersect, robust_orientation, robust_resection};
use super::settle::{start_limit, start_range_limit};
use super::start_calibration::start_calibration;
use super::{Network, PassiveCamera};
use crate::{Error, Result};

/// Share of the image points that start values may miss before others are looked for.
const MISSED: f64 = 0.2;

/// Stations in a row that no pose fits, after which the coordinates are given up: no pose will fit them.
const HOPELESS: usize = 5;

/// Attitudes nearer than this are one, radian: approximate ones are off by less, others by more.
const SAME_ATTITUDE: f64 = 0.1;

/// Which of the approximate values that are given are taken. Control is among them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Trust {
    stations: bool,
    targets: bool,
}

/// Finds start values for all stations and all targets that are seen.
///
/// What is given is kept, unless the observations contradict it: then poses, coordinates or both are found anew, whichever
/// fits best. Stations are oriented one after the other, the one with the most known targets first: where
/// it has ranges, by absolute orientation of the points that image points and ranges make; else by resection. Targets
/// follow from oriented stations as the median of their points, or as the intersection of rays. Where nothing at all
/// is given, the station with the most ranges becomes the origin.
pub(crate) fn find_start(
    network: &Network,
    calibration: &Calibration,
    passive: bool,
) -> Result<(Start, Option<String>)> {
    let given = attempt(network, calibration, passive, Trust { stations: true, targets: true });
    let missed = |start: &Start| missed(network, calibration, start);
    // Ranges tell which of two starts has the right scale.
    let share = |start: &Start| missed(start).max(ranges_missed(network, calibration, start));
    if given.as_ref().is_ok_and(|start| share(start) <= MISSED) {
        return given.map(|start| (start, None));
    }
    let has_stations = network.stations.iter().any(|station| station.world_from_camera.is_some());
    let has_targets = network.targets.iter().any(|target| target.point.is_some());
    // Control is the frame of all others.
    let free = !network.targets.iter().any(|target| target.covariance.is_some());
    let others =
        [(false, true, has_stations), (true, false, has_targets && free), (false, false, has_stations && free)];
    let others = others.into_iter().filter(|(.., possible)| *possible).filter_map(|(stations, targets, _)| {
        let trust = Trust { stations, targets };
        let start = attempt(network, calibration, passive, trust).ok()?;
        Some((share(&start), start, trust))
    });
    let best = others.min_by(|a, b| a.0.total_cmp(&b.0));
    let best = match given {
        Ok(given) => {
            // Where only ranges speak against what is given, they may themselves be wrong: then nothing fits them.
            let allowed = if missed(&given) <= MISSED { MISSED } else { missed(&given) };
            match best.filter(|(share, ..)| *share < allowed) {
                Some(best) => best,
                None => return Ok((given, None)),
            }
        }
        Err(error) => best.ok_or(error)?,
    };
    let (_, start, trust) = best;
    let words = unused_words(network, &start, trust);
    Ok((start, Some(words)))
}

/// Whether most image points lie where the given poses and coordinates put them; false where none are given.
pub(crate) fn fits_as_given(network: &Network) -> bool {
    let calibration = start_calibration(network);
    let limit = start_limit(network);
    let sizes = network.sightings.iter().filter_map(|seen| {
        let (pose, point) = (network.stations[seen.station].world_from_camera?, network.targets[seen.target].point?);
        Misfit::new(network, &calibration, &pose, &point, seen).pixels()
    });
    let sizes: Vec<f64> = sizes.collect();
    let near = sizes.iter().filter(|size| **size <= limit).count() as f64;
    !sizes.is_empty() && near >= (1.0 - MISSED) * sizes.len() as f64
}

/// Which given values were left aside.
fn unused_words(network: &Network, start: &Start, trust: Trust) -> String {
    let what = match (trust.stations, trust.targets) {
        (false, true) => "the poses given for the stations",
        (true, false) => "the coordinates given for the targets",
        _ => "the poses and coordinates given",
    };
    let radians = if trust.targets && in_radians(network, start) {
        ": their attitudes fit if they are radians instead of degrees"
    } else {
        ": check units, axes, signs and names"
    };
    format!("{what} contradict the observations and were not used as start values{radians}")
}

/// Whether most poses agree with those found when their attitudes, read as degrees, are taken for radians.
fn in_radians(network: &Network, start: &Start) -> bool {
    let agrees = |given: &Isometry3<f64>, found: &Isometry3<f64>| {
        let attitude = euler_from_pose(given).map(f64::to_degrees);
        pose_from_euler(given.translation.vector, attitude).rotation.angle_to(&found.rotation) < SAME_ATTITUDE
    };
    let pairs = network.stations.iter().zip(&start.stations);
    let pairs: Vec<_> = pairs.filter_map(|(station, found)| Some((station.world_from_camera?, found))).collect();
    2 * pairs.iter().filter(|(given, found)| agrees(given, found)).count() > pairs.len()
}

/// Start values that keep what is trusted.
fn attempt(network: &Network, calibration: &Calibration, passive: bool, trust: Trust) -> Result<Start> {
    let mut finder = Finder::new(network, calibration, trust);
    finder.run()?;
    finder.orient_anew();
    finder.drop_unseen(passive);
    let relative =
        network.passive.as_ref().filter(|_| passive).map(|passive| finder.relative_orientation(passive)).transpose()?;
    let stations = finder.stations.iter().copied().flatten().collect();
    Ok(Start { stations, targets: finder.targets, relative })
}

/// Share of the image points that lie farther from where start values put them than these may be off.
pub(crate) fn missed(network: &Network, calibration: &Calibration, start: &Start) -> f64 {
    let limit = start_limit(network);
    let misfits = misfits(network, calibration, start);
    let sizes: Vec<f64> = misfits.iter().filter_map(Misfit::pixels).collect();
    let far = sizes.iter().filter(|size| size.is_nan() || **size > limit).count();
    far as f64 / sizes.len().max(1) as f64
}

/// The same share of the ranges.
pub(crate) fn ranges_missed(network: &Network, calibration: &Calibration, start: &Start) -> f64 {
    let limit = start_range_limit(network, 0.0);
    let misfits = misfits(network, calibration, start);
    let sizes: Vec<f64> = misfits.iter().filter_map(|misfit| misfit.range_m).collect();
    sizes.iter().filter(|size| size.is_nan() || size.abs() > limit).count() as f64 / sizes.len().max(1) as f64
}

/// Pose of one station from targets and calibration known from the others, by its image points.
pub(crate) fn station_pose(
    network: &Network,
    calibration: &Calibration,
    targets: &[Option<Point3<f64>>],
    station: usize,
) -> Option<Isometry3<f64>> {
    let own = network.sightings.iter().filter(|seen| seen.station == station);
    let target = |seen: &super::Sighting| {
        let (pixel, point) = (seen.pixel?, targets[seen.target]?);
        Some(TargetObservation { sigma_pixel: seen.sigma_pixel, ..TargetObservation::new(point, pixel, 1.0) })
    };
    robust_resection(&calibration.camera, &own.filter_map(target).collect::<Vec<_>>()).ok()
}

struct Finder<'n> {
    network: &'n Network,
    calibration: &'n Calibration,
    stations: Vec<Option<Isometry3<f64>>>,
    targets: Vec<Option<Point3<f64>>>,
    /// Sightings with an image point, by station and by target.
    of_station: Vec<Vec<usize>>,
    of_target: Vec<Vec<usize>>,
    /// Points in the camera frame, of sightings with a range.
    local: Vec<Option<Point3<f64>>>,
    /// Targets whose coordinates are given and taken.
    given: Vec<bool>,
    /// Whether something that is given is not taken: one of several starts, which may fail.
    is_rival: bool,
}

impl<'n> Finder<'n> {
    fn new(network: &'n Network, calibration: &'n Calibration, trust: Trust) -> Self {
        let mut of_station = vec![Vec::new(); network.stations.len()];
        let mut of_target = vec![Vec::new(); network.targets.len()];
        let mut local = Vec::with_capacity(network.sightings.len());
        for (index, seen) in network.sightings.iter().enumerate() {
            if seen.pixel.is_some() {
                of_station[seen.station].push(index);
                of_target[seen.target].push(index);
            }
            local.push(seen.pixel.zip(seen.range_m).map(|(pixel, range_m)| {
                calibration.camera.point(pixel, corrected_range(network, calibration, seen, pixel, range_m))
            }));
        }
        let stations = network.stations.iter().map(|station| station.world_from_camera.filter(|_| trust.stations));
        let targets: Vec<_> = network.targets.iter().map(|target| target.point.filter(|_| trust.targets)).collect();
        let given = targets.iter().map(Option::is_some).collect();
        let stations = stations.collect();
        let is_rival = !(trust.stations && trust.targets);
        Self { network, calibration, stations, targets, of_station, of_target, local, given, is_rival }
    }

    fn run(&mut self) -> Result<()> {
        self.seed();
        // How many known targets a station had when it last could not be oriented.
        let mut failed = vec![(0_usize, String::new()); self.stations.len()];
        let (mut fitting, mut misfitting) = (0, 0);
        loop {
            self.place_targets();
            let waiting = (0..self.stations.len()).filter(|&station| self.stations[station].is_none());
            let counted = waiting.map(|station| (self.known_targets(station), station));
            let ready = counted.filter(|(known, station)| *known >= NEEDED && *known > failed[*station].0);
            // The best connected; of equal ones the first.
            let Some((known, station)) = ready.max_by_key(|(known, station)| (*known, usize::MAX - station)) else {
                break;
            };
            let found = self.orient(station);
            let fits = found.as_ref().is_ok_and(|pose| self.typical_miss(station, pose) <= start_limit(self.network));
            *(if fits { &mut fitting } else { &mut misfitting }) += 1;
            match found {
                Ok(pose) => self.stations[station] = Some(pose),
                Err(reason) => failed[station] = (known, reason),
            }
            if self.is_rival && fitting == 0 && misfitting >= HOPELESS {
                break;
            }
        }
        self.finish(&failed)
    }

    /// Without any coordinates the station with the most ranges is the origin.
    fn seed(&mut self) {
        let any_target = (0..self.stations.len()).any(|station| self.known_targets(station) >= NEEDED);
        if any_target || self.stations.iter().any(Option::is_some) {
            return;
        }
        let ranged = |station: usize| self.of_station[station].iter().filter(|i| self.local[**i].is_some()).count();
        let counted = (0..self.stations.len()).map(|station| (ranged(station), station));
        let best = counted.filter(|(ranges, _)| *ranges >= NEEDED).max_by_key(|(ranges, i)| (*ranges, usize::MAX - i));
        if let Some((_, station)) = best {
            self.stations[station] = Some(Isometry3::identity());
        }
    }

    fn finish(&mut self, failed: &[(usize, String)]) -> Result<()> {
        if let Some(station) = self.stations.iter().position(Option::is_none) {
            let name = self.network.stations[station].name.clone();
            let known = self.known_targets(station);
            let reason = match &failed[station].1 {
                reason if !reason.is_empty() => reason.clone(),
                _ if self.stations.iter().all(Option::is_none) => {
                    "there are neither coordinates of three targets, nor ranges, nor a pose to begin with".to_owned()
                }
                _ => format!("it shares {known} targets with what can be oriented, and three are needed"),
            };
            return Err(Error::NotReachable { kind: "station", name, reason });
        }
        // Once more with all stations, so that a gross error of the first does not stay.
        for target in 0..self.targets.len() {
            if !self.given[target] {
                self.targets[target] = self.placed(target);
            }
            if self.targets[target].is_none() && !self.of_target[target].is_empty() {
                let name = self.network.targets[target].name.clone();
                let reason = "no range, and no two rays that meet at more than a degree".to_owned();
                return Err(Error::NotReachable { kind: "target", name, reason });
            }
        }
        Ok(())
    }

    /// Orients stations anew whose image points contradict their pose, where that fits better.
    fn orient_anew(&mut self) {
        let limit = start_limit(self.network);
        let (mut found_any, mut kept) = (false, 0);
        for station in 0..self.stations.len() {
            if !found_any && kept >= HOPELESS {
                return;
            }
            let Some(pose) = self.stations[station] else { continue };
            let before = self.typical_miss(station, &pose);
            if before <= limit {
                continue;
            }
            if let Some(found) = station_pose(self.network, self.calibration, &self.targets, station)
                && 2.0 * self.typical_miss(station, &found) < before
            {
                self.stations[station] = Some(found);
                found_any = true;
            } else {
                kept += 1;
            }
        }
    }

    /// Median distance of a station's image points from where a pose puts them, pixel.
    fn typical_miss(&self, station: usize, pose: &Isometry3<f64>) -> f64 {
        let sizes = self.of_station[station].iter().filter_map(|&index| {
            let seen = &self.network.sightings[index];
            let point = self.targets[seen.target]?;
            Misfit::new(self.network, self.calibration, pose, &point, seen).pixels()
        });
        median(sizes.collect())
    }

    /// A target that nothing sees is no unknown.
    fn drop_unseen(&mut self, passive: bool) {
        let partner = self.network.passive.iter().filter(|_| passive).flat_map(|passive| &passive.image_points);
        let partner: std::collections::BTreeSet<usize> = partner.map(|seen| seen.target).collect();
        for (target, place) in self.targets.iter_mut().enumerate() {
            if self.of_target[target].is_empty() && !partner.contains(&target) {
                *place = None;
            }
        }
    }

    fn known_targets(&self, station: usize) -> usize {
        self.of_station[station].iter().filter(|i| self.targets[self.network.sightings[**i].target].is_some()).count()
    }

    fn place_targets(&mut self) {
        for target in 0..self.targets.len() {
            if self.targets[target].is_none() {
                self.targets[target] = self.placed(target);
            }
        }
    }

    /// A target from the stations that are oriented: the median of its points, or the intersection of its rays.
    fn placed(&self, target: usize) -> Option<Point3<f64>> {
        let seen = self.of_target[target].iter().filter_map(|&index| {
            let sighting = &self.network.sightings[index];
            let pose = self.stations[sighting.station]?;
            Some((index, pose, sighting.pixel?))
        });
        let seen: Vec<_> = seen.collect();
        let points: Vec<Point3<f64>> = seen.iter().filter_map(|(i, pose, _)| Some(pose * self.local[*i]?)).collect();
        if !points.is_empty() {
            let along = |axis: usize| median(points.iter().map(|point| point[axis]).collect());
            return Some(Point3::new(along(0), along(1), along(2)));
        }
        let ray = |pose: &Isometry3<f64>, pixel| (pose.translation.vector, pose * self.calibration.camera.ray(pixel));
        intersect(&seen.iter().map(|(_, pose, pixel)| ray(pose, *pixel)).collect::<Vec<_>>())
    }

    /// Pose of a station from its known targets.
    fn orient(&self, station: usize) -> std::result::Result<Isometry3<f64>, String> {
        let known: Vec<(usize, Point3<f64>)> = self.of_station[station]
            .iter()
            .filter_map(|&index| Some((index, self.targets[self.network.sightings[index].target]?)))
            .collect();
        let ranged: Vec<(Point3<f64>, Point3<f64>)> =
            known.iter().filter_map(|(index, world)| Some((self.local[*index]?, *world))).collect();
        if ranged.len() >= NEEDED
            && let Some(pose) = robust_orientation(&ranged)
            && self.typical_miss(station, &pose) <= start_limit(self.network)
        {
            return Ok(pose);
        }
        let target = |(index, world): &(usize, Point3<f64>)| {
            let seen = &self.network.sightings[*index];
            let pixel = seen.pixel?;
            Some(TargetObservation { sigma_pixel: seen.sigma_pixel, ..TargetObservation::new(*world, pixel, 1.0) })
        };
        robust_resection(&self.calibration.camera, &known.iter().filter_map(target).collect::<Vec<_>>())
    }

    /// `range_camera_from_passive`: given, or from the station whose passive image fits its targets best.
    fn relative_orientation(&self, passive: &PassiveCamera) -> Result<Isometry3<f64>> {
        if let Some(given) = passive.range_camera_from_passive {
            return Ok(given);
        }
        let mut poses = Vec::new();
        for (station, pose) in self.stations.iter().enumerate() {
            let Some(pose) = pose else { continue };
            let points = passive.image_points.iter().filter(|seen| seen.station == station);
            let targets: Vec<TargetObservation> = points
                .filter_map(|seen| {
                    let world = self.targets[seen.target]?;
                    let sigma_pixel = seen.sigma_pixel;
                    Some(TargetObservation { sigma_pixel, ..TargetObservation::new(world, seen.pixel, 1.0) })
                })
                .collect();
            // One decision needs four.
            if targets.len() > NEEDED
                && let Ok(world_from_passive) = robust_resection(&passive.camera, &targets)
            {
                poses.push(pose.inverse() * world_from_passive);
            }
        }
        // The one that the others are nearest to.
        let distance = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
        };
        let spread = |pose: &Isometry3<f64>| median(poses.iter().map(|other| distance(pose, other)).collect());
        let best = poses.iter().min_by(|a, b| spread(a).total_cmp(&spread(b)));
        best.copied().ok_or_else(|| Error::NotReachable {
            kind: "camera",
            name: "passive".to_owned(),
            reason: "no station gives its relative orientation: four targets in one of its images are needed"
                .to_owned(),
        })
    }
}
