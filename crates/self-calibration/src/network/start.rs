//! Start values: poses and coordinates from whatever is known, gross errors among the observations or not.

use icp_registration::absolute_orientation;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use orientation::{ResectionOptions, TargetObservation, resect};

use super::problem::{Calibration, Start};
use super::{Network, PassiveCamera, Station};
use crate::{Error, Result};

/// Targets that orient a station.
const NEEDED: usize = 3;
/// Residuals beyond so many times the median's standard deviation are gross errors for a start value.
const OUTLYING: f64 = 4.0;
/// Rays that meet at less than this angle (radian, 1 degree) place a target too weakly to start from.
const SMALLEST_ANGLE: f64 = 0.0175;

/// Finds start values for all stations and all targets that are seen.
///
/// What is given is kept. Stations are oriented one after the other, the one with the most known targets first: where
/// it has ranges, by absolute orientation of the points that image points and ranges make; else by resection. Targets
/// follow from oriented stations as the median of their points, or as the intersection of rays. Where nothing at all
/// is given, the station with the most ranges becomes the origin.
pub(crate) fn find_start(network: &Network, calibration: &Calibration, passive: bool) -> Result<Start> {
    let mut finder = Finder::new(network, calibration);
    finder.run()?;
    finder.drop_unseen(passive);
    let relative =
        network.passive.as_ref().filter(|_| passive).map(|passive| finder.relative_orientation(passive)).transpose()?;
    let stations = finder.stations.iter().copied().flatten().collect();
    Ok(Start { stations, targets: finder.targets, relative })
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
}

impl<'n> Finder<'n> {
    fn new(network: &'n Network, calibration: &'n Calibration) -> Self {
        let mut of_station = vec![Vec::new(); network.stations.len()];
        let mut of_target = vec![Vec::new(); network.targets.len()];
        let mut local = Vec::with_capacity(network.sightings.len());
        for (index, seen) in network.sightings.iter().enumerate() {
            if seen.pixel.is_some() {
                of_station[seen.station].push(index);
                of_target[seen.target].push(index);
            }
            let Station { integration_time_s: time, drift_m, .. } = network.stations[seen.station];
            let set = calibration.sets.iter().find(|set| set.time == time);
            local.push(seen.pixel.zip(seen.range_m).map(|(pixel, range_m)| {
                let [x, y] = calibration.camera.format.image_from_pixel(pixel);
                let [xp, yp] = calibration.camera.interior.principal_point_mm;
                let amplitude = seen.amplitude.unwrap_or(f64::NAN);
                let corrected = set.map(|set| set.model.corrected_range(range_m, x - xp, y - yp, amplitude));
                calibration.camera.point(pixel, corrected.unwrap_or(range_m) - drift_m)
            }));
        }
        let stations = network.stations.iter().map(|station| station.world_from_camera).collect();
        let targets = network.targets.iter().map(|target| target.point).collect();
        Self { network, calibration, stations, targets, of_station, of_target, local }
    }

    fn run(&mut self) -> Result<()> {
        self.seed();
        // How many known targets a station had when it last could not be oriented.
        let mut failed = vec![(0_usize, String::new()); self.stations.len()];
        loop {
            self.place_targets();
            let waiting = (0..self.stations.len()).filter(|&station| self.stations[station].is_none());
            let counted = waiting.map(|station| (self.known_targets(station), station));
            let ready = counted.filter(|(known, station)| *known >= NEEDED && *known > failed[*station].0);
            // The best connected; of equal ones the first.
            let Some((known, station)) = ready.max_by_key(|(known, station)| (*known, usize::MAX - station)) else {
                break;
            };
            match self.orient(station) {
                Ok(pose) => self.stations[station] = Some(pose),
                Err(reason) => failed[station] = (known, reason),
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
            if self.network.targets[target].point.is_none() {
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
        {
            return Ok(pose);
        }
        let target = |(index, world): &(usize, Point3<f64>)| {
            let seen = &self.network.sightings[*index];
            let pixel = seen.pixel?;
            Some(TargetObservation { sigma_pixel: seen.sigma_pixel, ..TargetObservation::new(*world, pixel, 1.0) })
        };
        robust_resection(&self.calibration.camera, known.iter().filter_map(target).collect())
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
                && let Ok(world_from_passive) = robust_resection(&passive.camera, targets)
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

/// Absolute orientation `target_from_source` that most pairs agree with: the triple with the least median residual, then
/// twice all pairs that fit it.
fn robust_orientation(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Isometry3<f64>> {
    let n = pairs.len();
    let fit = |chosen: &[usize]| {
        let source: Vec<_> = chosen.iter().map(|&i| pairs[i].0).collect();
        let target: Vec<_> = chosen.iter().map(|&i| pairs[i].1).collect();
        absolute_orientation(&source, &target, None).ok().map(|orientation| orientation.target_from_source)
    };
    let residuals = |pose: &Isometry3<f64>| pairs.iter().map(|(a, b)| (pose * a - b).norm()).collect::<Vec<f64>>();
    let strides = [(n / 3, 2 * n / 3), (n / 4, n / 2), (1, n / 2)];
    let triples = strides.iter().flat_map(|&(a, b)| (0..n).map(move |i| [i, (i + a) % n, (i + b) % n]));
    let distinct = triples.filter(|[a, b, c]| a != b && b != c && a != c);
    let scored = distinct.filter_map(|triple| fit(&triple)).map(|pose| (median(residuals(&pose)), pose));
    let (_, mut pose) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
    for _ in 0..2 {
        let distances = residuals(&pose);
        let limit = OUTLYING * 1.4826 * median(distances.clone());
        // Half of the pairs lie below the median in any case; without noise rounding decides.
        let inliers: Vec<usize> = (0..n).filter(|&i| distances[i] <= limit.max(1e-9)).collect();
        if inliers.len() >= NEEDED {
            pose = fit(&inliers).unwrap_or(pose);
        }
    }
    Some(pose)
}

/// Resection that leaves out the worst target as long as it stands out from the others.
fn robust_resection(
    camera: &camera_model::Camera,
    mut targets: Vec<TargetObservation>,
) -> std::result::Result<Isometry3<f64>, String> {
    let fewest = (targets.len() * 2).div_ceil(3).max(NEEDED + 1);
    loop {
        let found = resect(camera, &targets, &ResectionOptions::default()).map_err(|error| error.to_string())?;
        let sizes: Vec<f64> = found.residuals.iter().map(|r| r.pixel[0].hypot(r.pixel[1])).collect();
        let worst = (0..sizes.len()).max_by(|&a, &b| sizes[a].total_cmp(&sizes[b]));
        let limit = 2.0 * OUTLYING * median(sizes.clone());
        match worst {
            Some(worst) if sizes[worst] > limit && targets.len() > fewest => targets.remove(worst),
            _ => return Ok(found.world_from_camera),
        };
    }
}

/// The point nearest to some rays (origin, unit direction); `None` where they are nearly parallel.
fn intersect(rays: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Point3<f64>> {
    let angle = |a: &Vector3<f64>, b: &Vector3<f64>| a.cross(b).norm();
    let widest = rays.iter().flat_map(|a| rays.iter().map(move |b| angle(&a.1, &b.1))).fold(0.0, f64::max);
    if widest < SMALLEST_ANGLE {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (origin, direction) in rays {
        let across = Matrix3::identity() - direction * direction.transpose();
        normal += across;
        right += across * origin;
    }
    normal.try_inverse().map(|inverse| Point3::from(inverse * right))
}

/// The lower median; NaN of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
