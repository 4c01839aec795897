//! Poses and coordinates found one after the other, from those that are known.

use nalgebra::{Isometry3, Point3};
use orientation::{
    TargetObservation, intersect_rays, robust_absolute_orientation, robust_resection, trimmed_resection,
};

use crate::functional_model::misfit::{Misfit, corrected_range, median};
use crate::functional_model::setup::Calibration;
use crate::start_values::image_start;
use crate::start_values::settle::start_limit;
use crate::start_values::start::Trust;
use crate::{Error, Network, PassiveCamera, Result};

/// Targets that orient a station.
pub const NEEDED: usize = 3;
/// Stations in a row that no pose fits, after which the coordinates are given up: no pose will fit them.
const HOPELESS: usize = 5;

/// Pose of one station from targets and calibration known from the others, by its image points.
pub fn station_pose(
    network: &Network,
    calibration: &Calibration,
    targets: &[Option<Point3<f64>>],
    station: usize,
) -> Option<Isometry3<f64>> {
    let own = network.sightings.iter().filter(|seen| seen.station == station);
    robust_resection(&calibration.camera, &seen_targets(own, targets)).ok()
}

/// Where stations at these poses see a target; `None` where too little tells.
pub(crate) fn target_point(
    network: &Network,
    calibration: &Calibration,
    stations: &[Isometry3<f64>],
    target: usize,
) -> Option<Point3<f64>> {
    let mut finder = Finder::new(network, calibration, Trust { stations: false, targets: false });
    finder.stations = stations.iter().copied().map(Some).collect();
    finder.placed(target)
}

/// The targets with coordinates among these sightings with an image point.
fn seen_targets<'s>(
    sightings: impl Iterator<Item = &'s crate::Sighting>,
    targets: &[Option<Point3<f64>>],
) -> Vec<TargetObservation> {
    let target = |seen: &crate::Sighting| {
        let (pixel, point) = (seen.pixel?, targets[seen.target]?);
        Some(TargetObservation { sigma_pixel: seen.sigma_pixel, ..TargetObservation::new(point, pixel, 1.0) })
    };
    sightings.filter_map(target).collect()
}

/// Poses and coordinates known so far.
pub(crate) struct Finder<'n> {
    network: &'n Network,
    calibration: &'n Calibration,
    pub(crate) stations: Vec<Option<Isometry3<f64>>>,
    pub(crate) targets: Vec<Option<Point3<f64>>>,
    /// Sightings with an image point, by station and by target.
    of_station: Vec<Vec<usize>>,
    of_target: Vec<Vec<usize>>,
    /// Points in the camera frame, of sightings with a range.
    local: Vec<Option<Point3<f64>>>,
    /// Targets whose coordinates are given and taken.
    given: Vec<bool>,
    /// Whether something that is given is not taken: one of several starts, which may fail.
    is_rival: bool,
    /// Why image points alone gave nothing to begin with.
    no_seed: String,
}

impl<'n> Finder<'n> {
    pub(crate) fn new(network: &'n Network, calibration: &'n Calibration, trust: Trust) -> Self {
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
        Self {
            network,
            calibration,
            stations,
            targets,
            of_station,
            of_target,
            local,
            given,
            is_rival,
            no_seed: String::new(),
        }
    }

    pub(crate) fn run(&mut self) -> Result<()> {
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

    /// Without any coordinates the station with the most ranges is the origin; without ranges some stations are oriented
    /// relative to each other.
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
            return;
        }
        match image_start::poses(self.network, &self.calibration.camera) {
            Ok(poses) => poses.into_iter().for_each(|(station, pose)| self.stations[station] = Some(pose)),
            Err(reason) => self.no_seed = reason,
        }
    }

    fn finish(&mut self, failed: &[(usize, String)]) -> Result<()> {
        if let Some(station) = self.stations.iter().position(Option::is_none) {
            let name = self.network.stations[station].name.clone();
            let known = self.known_targets(station);
            let reason = match &failed[station].1 {
                reason if !reason.is_empty() => reason.clone(),
                _ if self.stations.iter().all(Option::is_none) => {
                    format!(
                        "there are neither coordinates of three targets, nor ranges, nor a pose to begin with, and image points \
                         alone orient no stations: {}",
                        self.no_seed
                    )
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

    /// Orients stations anew whose image points contradict their pose, where that fits better: from that pose, which is
    /// mostly near enough, or else from none.
    pub(crate) fn orient_anew(&mut self) {
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
            let own = self.of_station[station].iter().map(|&index| &self.network.sightings[index]);
            let seen = seen_targets(own, &self.targets);
            let refined = trimmed_resection(&self.calibration.camera, seen.clone(), Some(pose));
            if let Some(found) = refined.ok().filter(|found| self.typical_miss(station, found) <= limit) {
                self.stations[station] = Some(found);
                found_any = true;
                continue;
            }
            if let Ok(found) = robust_resection(&self.calibration.camera, &seen)
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
    pub(crate) fn drop_unseen(&mut self, passive: bool) {
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
        intersect_rays(&seen.iter().map(|(_, pose, pixel)| ray(pose, *pixel)).collect::<Vec<_>>())
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
            && let Some(pose) = robust_absolute_orientation(&ranged)
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
            .map_err(|error| error.to_string())
    }

    /// `range_camera_from_passive`: given, or from the station whose passive image fits its targets best.
    pub(crate) fn relative_orientation(&self, passive: &PassiveCamera) -> Result<Isometry3<f64>> {
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
