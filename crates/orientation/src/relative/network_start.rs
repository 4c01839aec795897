//! Start values of a network, from station to station.

use std::collections::BTreeMap;

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use statistics::upper_median;

use crate::relative::bundle::TieObservation;
use crate::relative::consensus::{FITS, consensus_resection};
use crate::relative::network::NetworkOptions;
use crate::relative::two_views::{RelativeOrientationOptions, orient_two_views};
use crate::target::NEEDED;
use crate::{
    Error, ImagePoint, Result, TargetObservation, intersect_rays, robust_absolute_orientation, robust_resection,
};

/// Pairs of stations whose relative orientation is tried, those that share most first: the best determined begins.
const MOST_PAIRS: usize = 10;

/// Best determined pairs that a start is made from: gross errors may spoil one, hardly all.
const MOST_SEEDS: usize = 3;

/// Poses of stations in the frame of the first, and points.
#[derive(Debug, Clone)]
pub(crate) struct Start {
    pub(crate) stations: Vec<Isometry3<f64>>,
    pub(crate) points: Vec<Option<Point3<f64>>>,
}

impl Start {
    /// Enlarges all lengths.
    pub(crate) fn scale_by(&mut self, factor: f64) {
        self.stations.iter_mut().for_each(|pose| pose.translation.vector *= factor);
        self.points.iter_mut().flatten().for_each(|point| point.coords *= factor);
    }
}

/// Starts that may each lead to the solution: more than one only where two views leave a choice.
pub(crate) fn starts(camera: &Camera, observations: &[TieObservation], options: &NetworkOptions) -> Result<Vec<Start>> {
    let finder = Finder::new(camera, observations, options.seed);
    let from_ranges = finder.seed_by_ranges().map(|seed| finder.grown(&[(seed, Isometry3::identity())]));
    let failure = match from_ranges {
        Some(Ok(start)) => return Ok(vec![start]),
        Some(Err(error)) => Some(error),
        None => None,
    };
    let pairs = match (finder.seeds_by_views(options), failure) {
        (Ok(pairs), _) => pairs,
        (Err(_), Some(error)) | (Err(error), None) => return Err(error),
    };
    let mut starts = Vec::new();
    let mut first_failure = None;
    for [(first, a), (second, b)] in pairs {
        match finder.grown(&[(first, a), (second, b)]) {
            Ok(start) => starts.push(start),
            Err(error) => first_failure = first_failure.or(Some(error)),
        }
    }
    match first_failure {
        Some(error) if starts.is_empty() => Err(error),
        _ => Ok(starts),
    }
}

/// A station and its pose.
type Placed = (usize, Isometry3<f64>);

/// Observations by station and by target.
struct Finder<'o> {
    camera: &'o Camera,
    observations: &'o [TieObservation],
    of_station: Vec<Vec<usize>>,
    of_target: Vec<Vec<usize>>,
    /// Points in the camera frame, of observations with a range.
    local: Vec<Option<Point3<f64>>>,
    /// Of the choice of samples.
    seed: u64,
}

impl<'o> Finder<'o> {
    fn new(camera: &'o Camera, observations: &'o [TieObservation], seed: u64) -> Self {
        let count = |number: fn(&TieObservation) -> usize| observations.iter().map(number).max().map_or(0, |n| n + 1);
        let mut of_station = vec![Vec::new(); count(|seen| seen.station)];
        let mut of_target = vec![Vec::new(); count(|seen| seen.target)];
        let mut local = Vec::with_capacity(observations.len());
        for (index, seen) in observations.iter().enumerate() {
            of_station[seen.station].push(index);
            of_target[seen.target].push(index);
            local.push(seen.range.map(|range| camera.point(seen.image.pixel, range.range_m)));
        }
        Self { camera, observations, of_station, of_target, local, seed }
    }

    /// The station with the most ranges, where they make a frame.
    fn seed_by_ranges(&self) -> Option<usize> {
        let ranged = |own: &[usize]| own.iter().filter(|&&index| self.local[index].is_some()).count();
        let counted = self.of_station.iter().enumerate().map(|(station, own)| (ranged(own), station));
        let best = counted.max_by_key(|&(ranges, station)| (ranges, usize::MAX - station))?;
        (best.0 >= NEEDED).then_some(best.1)
    }

    /// The relative orientations whose bases are determined best; all solutions of one where all have several.
    fn seeds_by_views(&self, options: &NetworkOptions) -> Result<Vec<[Placed; 2]>> {
        let stations = self.of_station.len();
        let pairs = (0..stations).flat_map(|a| (a + 1..stations).map(move |b| (a, b)));
        let mut shared: Vec<_> = pairs.map(|(a, b)| (a, b, self.shared(a, b))).collect();
        shared.sort_by_key(|(a, b, views)| (usize::MAX - views[0].len(), *a, *b));
        let options = RelativeOrientationOptions { seed: options.seed, solve: options.solve.clone() };
        let mut found: Vec<(f64, [Placed; 2])> = Vec::new();
        let (mut ambiguous, mut failure) = (None, None);
        for (a, b, [first, second]) in shared.into_iter().take(MOST_PAIRS) {
            let placed = |pose: Isometry3<f64>| [(a, Isometry3::identity()), (b, pose)];
            match orient_two_views([self.camera; 2], [&first, &second], &options) {
                Ok(views) => {
                    let variance = views.covariance.fixed_view::<3, 3>(0, 0).trace();
                    found.push((variance, placed(views.first_from_second)));
                }
                Err(Error::Ambiguous { poses, .. }) => {
                    ambiguous.get_or_insert_with(|| poses.into_iter().map(placed).collect::<Vec<_>>());
                }
                Err(error) => failure = failure.or(Some(error)),
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        match ambiguous {
            _ if !found.is_empty() => Ok(found.into_iter().take(MOST_SEEDS).map(|(_, pair)| pair).collect()),
            Some(pairs) => Ok(pairs),
            None => Err(failure.unwrap_or(Error::NotConnected { station: 0, shared: 0 })),
        }
    }

    /// Image points of the targets that two stations share.
    fn shared(&self, a: usize, b: usize) -> [Vec<ImagePoint>; 2] {
        let by_target: BTreeMap<usize, ImagePoint> = self.of_station[a]
            .iter()
            .map(|&index| (self.observations[index].target, self.observations[index].image))
            .collect();
        let mut views = [Vec::new(), Vec::new()];
        for &index in &self.of_station[b] {
            if let Some(image) = by_target.get(&self.observations[index].target) {
                views[0].push(*image);
                views[1].push(self.observations[index].image);
            }
        }
        views
    }

    /// All other stations, one after the other, in the frame of the first station.
    fn grown(&self, placed: &[Placed]) -> Result<Start> {
        let mut stations: Vec<Option<Isometry3<f64>>> = vec![None; self.of_station.len()];
        for (station, pose) in placed {
            stations[*station] = Some(*pose);
        }
        let mut points: Vec<Option<Point3<f64>>> = vec![None; self.of_target.len()];
        let with_ranges = placed.len() == 1;
        // How many known targets a station had when it last could not be oriented.
        let mut tried: Vec<(usize, Option<Error>)> = self.of_station.iter().map(|_| (0, None)).collect();
        loop {
            for (target, point) in points.iter_mut().enumerate().filter(|(_, point)| point.is_none()) {
                *point = self.point(target, &stations, with_ranges);
            }
            let waiting = (0..stations.len()).filter(|&station| stations[station].is_none());
            let counted = waiting.map(|station| (self.known(station, &points), station));
            let ready = counted.filter(|&(known, station)| known >= NEEDED && known > tried[station].0);
            let Some((known, station)) = ready.max_by_key(|&(known, station)| (known, usize::MAX - station)) else {
                break;
            };
            match self.pose(station, &points, with_ranges) {
                Ok(pose) => stations[station] = Some(pose),
                Err(error) => tried[station] = (known, Some(error)),
            }
        }
        if let Some(station) = stations.iter().position(Option::is_none) {
            let shared = self.known(station, &points);
            return Err(tried.swap_remove(station).1.unwrap_or(Error::NotConnected { station, shared }));
        }
        // Once more with all points and all stations, so that a gross error of the first does not stay.
        for station in (0..stations.len()).filter(|station| placed.iter().all(|(seed, _)| seed != station)) {
            stations[station] = self.pose(station, &points, with_ranges).ok().or(stations[station]);
        }
        for (target, point) in points.iter_mut().enumerate() {
            *point = self.point(target, &stations, with_ranges);
        }
        let stations: Vec<Isometry3<f64>> = stations.into_iter().flatten().collect();
        let first_from_frame = stations.first().map_or_else(Isometry3::identity, Isometry3::inverse);
        let mut start = Start {
            stations: stations.iter().map(|pose| first_from_frame * pose).collect(),
            points: points.into_iter().map(|point| point.map(|point| first_from_frame * point)).collect(),
        };
        if !with_ranges && let Some(scale) = self.scale(&start) {
            start.scale_by(scale);
        }
        Ok(start)
    }

    fn known(&self, station: usize, points: &[Option<Point3<f64>>]) -> usize {
        self.of_station[station].iter().filter(|&&index| points[self.observations[index].target].is_some()).count()
    }

    /// A target from the stations that are oriented: the median of its points, or the intersection of its rays.
    fn point(&self, target: usize, stations: &[Option<Isometry3<f64>>], with_ranges: bool) -> Option<Point3<f64>> {
        let seen = self.of_target[target]
            .iter()
            .filter_map(|&index| Some((index, stations[self.observations[index].station]?)));
        let seen: Vec<(usize, Isometry3<f64>)> = seen.collect();
        let local = seen.iter().filter(|_| with_ranges).filter_map(|(index, pose)| Some(pose * self.local[*index]?));
        let found: Vec<Point3<f64>> = local.collect();
        if !found.is_empty() {
            let along = |axis: usize| upper_median(&mut found.iter().map(|point| point[axis]).collect::<Vec<f64>>());
            return Some(Point3::new(along(0), along(1), along(2)));
        }
        self.intersection(&seen)
    }

    /// Where most rays meet: all of them, or else the two on which most of the others agree. `None` where no two do, or the point
    /// lies behind one of the cameras: there is nothing to be adjusted.
    fn intersection(&self, seen: &[(usize, Isometry3<f64>)]) -> Option<Point3<f64>> {
        let image = |index: usize| &self.observations[index].image;
        let ray = |(index, pose): &(usize, Isometry3<f64>)| {
            (pose.translation.vector, pose * self.camera.ray(image(*index).pixel))
        };
        let agreeing = |point: &Point3<f64>| {
            let agrees = |(index, pose): &&(usize, Isometry3<f64>)| {
                let modelled = self.camera.project(&pose.inverse_transform_point(point));
                let [sigma_col, sigma_row] = image(*index).sigma_pixel;
                let [col, row] = image(*index).pixel;
                modelled.is_ok_and(|[x, y]| ((x - col) / sigma_col).hypot((y - row) / sigma_row) <= FITS)
            };
            seen.iter().filter(agrees).count()
        };
        let all = intersect_rays(&seen.iter().map(ray).collect::<Vec<_>>())?;
        if agreeing(&all) == seen.len() {
            return Some(all);
        }
        let pairs = seen.iter().enumerate().flat_map(|(i, a)| seen[i + 1..].iter().map(move |b| [ray(a), ray(b)]));
        let candidates = pairs.filter_map(|pair| intersect_rays(&pair)).map(|point| (agreeing(&point), point));
        candidates.max_by_key(|(count, _)| *count).filter(|(count, _)| *count >= 2).map(|(_, point)| point)
    }

    /// Pose of a station from the points found so far.
    fn pose(&self, station: usize, points: &[Option<Point3<f64>>], with_ranges: bool) -> Result<Isometry3<f64>> {
        let known = self.of_station[station]
            .iter()
            .filter_map(|&index| Some((index, points[self.observations[index].target]?)));
        let known: Vec<(usize, Point3<f64>)> = known.collect();
        let ranged =
            known.iter().filter(|_| with_ranges).filter_map(|(index, point)| Some((self.local[*index]?, *point)));
        let ranged: Vec<(Point3<f64>, Point3<f64>)> = ranged.collect();
        if ranged.len() >= NEEDED
            && let Some(pose) = robust_absolute_orientation(&ranged)
        {
            return Ok(pose);
        }
        let target = |(index, point): &(usize, Point3<f64>)| {
            let image = &self.observations[*index].image;
            TargetObservation { sigma_pixel: image.sigma_pixel, ..TargetObservation::new(*point, image.pixel, 1.0) }
        };
        let targets: Vec<_> = known.iter().map(target).collect();
        consensus_resection(self.camera, &targets, self.seed)
            .map_or_else(|| robust_resection(self.camera, &targets), Ok)
    }

    /// What lengths of the images are to be multiplied by, where there are ranges.
    fn scale(&self, start: &Start) -> Option<f64> {
        let ratio = |seen: &TieObservation| {
            let (range, point) = (seen.range?, start.points[seen.target]?);
            Some(range.range_m / (point.coords - start.stations[seen.station].translation.vector).norm())
        };
        let mut ratios: Vec<f64> = self.observations.iter().filter_map(ratio).collect();
        let scale = upper_median(&mut ratios);
        scale.is_finite().then_some(scale)
    }
}
