//! Whether a calibration predicts what stations observed that took no part in it.
//!
//! Every so many stations are left out and the rest is adjusted. What these stations observed is then predicted: their poses
//! come from their image points, and the ranges from poses, targets and range terms. How large the differences may be, with
//! all correlations between calibration, targets and poses, follows from adjustments that take the observations in again:
//! vᵀPv grows by the squares of the innovations, each in its own variance, and has as many degrees of freedom more as the
//! redundancy grows by. First the image points of the left-out stations are taken in, then their ranges.

use std::collections::{BTreeMap, BTreeSet};

use adjust::{GlobalTest, GlobalVerdict};
use calibration_network::functional_model::modelled_pixel;
use calibration_network::start_values::NEEDED;
use nalgebra::{Isometry3, Point3};
use orientation::{TargetObservation, robust_resection};

use crate::methods::problem::Problem;
use crate::{
    CalibrationOptions, CalibrationOutcome, Component, DistanceEnd, Error, Method, Network, Result, Sighting, Verdict,
};

/// Probability that the check of image points or of ranges fails on either side where the calibration is sound.
const LEVEL: f64 = 0.002;

/// How well a calibration predicts stations that were left out of it.
#[derive(Debug, Clone)]
pub struct HoldOut {
    /// The stations, by name.
    pub stations: Vec<String>,
    /// Their image points: columns and rows.
    pub image: Prediction,
    /// Their ranges; `None` where they have none, or none whose range terms the other stations show.
    pub range: Option<Prediction>,
}

/// What was predicted of one kind.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// Values.
    pub values: usize,
    /// Root mean square of observed minus predicted, pixel or metre: with poses that fit the image points best.
    pub rms: f64,
    /// Mean of observed minus predicted.
    pub mean: f64,
    /// The test of the innovations; `None` where there is no redundancy, or automatic terms were others without the stations.
    pub test: Option<GlobalTest>,
}

impl Prediction {
    /// Differences between observed and predicted values of one kind, and the test of what vᵀPv and redundancy grew by when the values
    /// were taken in, at a level.
    pub fn new(differences: &[f64], subject: &str, (growth, degrees): (f64, f64), level: f64) -> Self {
        let count = differences.len().max(1) as f64;
        Self {
            values: differences.len(),
            rms: (differences.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
            mean: differences.iter().sum::<f64>() / count,
            // Rounding must not make a square negative.
            test: GlobalTest::new(subject, growth.max(0.0), degrees, level).ok(),
        }
    }

    /// Whether the values lie further from the prediction than both were said to be uncertain.
    pub fn fails(&self) -> bool {
        self.test.as_ref().is_some_and(|test| test.verdict == GlobalVerdict::TooLarge)
    }
}

impl HoldOut {
    /// Whether image points or ranges fail.
    pub fn fails(&self) -> bool {
        self.image.fails() || self.range.as_ref().is_some_and(Prediction::fails)
    }
}

/// Leaves every `every`-th station of a network out, calibrates with the others as `options` say, and compares. What
/// `outcome`, the calibration from all stations, rejected takes no part.
///
/// # Errors
/// [`Error::MethodNeeds`] for methods that do not adjust the stations of one network together, for `every` below 2 and for
/// fewer stations than that; whatever a calibration without these stations is refused for.
pub fn hold_out(
    network: &Network,
    options: &CalibrationOptions,
    outcome: &CalibrationOutcome,
    every: usize,
) -> Result<HoldOut> {
    let needs = |needs: &str| Error::MethodNeeds { method: options.method.name().to_owned(), needs: needs.to_owned() };
    if matches!(options.method, Method::Laboratory | Method::TwoStepIndependent) {
        return Err(needs("nothing that a left-out station could check: its stations are not adjusted together"));
    }
    let left_out = |station: usize| every >= 2 && station % every == every - 1;
    if every < 2 || network.stations.len() < every {
        return Err(needs(&format!("2 or more for a hold-out check, and as many stations, found {every}")));
    }
    let clean = without_rejected(network, outcome);
    let names: BTreeSet<&str> = network
        .stations
        .iter()
        .enumerate()
        .filter(|(k, _)| left_out(*k))
        .map(|(_, station)| station.name.as_str())
        .collect();
    let rest = reduced(&clean, |station| !names.contains(station), |_| true);
    let options = CalibrationOptions { rejection_level: None, ..options.clone() };
    let unseen = CalibrationOptions {
        without_ranges: clean
            .stations
            .iter()
            .map(|station| &station.name)
            .filter(|name| names.contains(name.as_str()) || options.without_ranges.contains(name))
            .cloned()
            .collect(),
        ..options.clone()
    };
    let [first, with_image, with_ranges] =
        [(&rest, &options), (&clean, &unseen), (&clean, &options)].map(|(network, options)| adjusted(network, options));
    let (first, with_image, with_ranges) = (first?, with_image?, with_ranges?);
    let predicted = predictions(&clean, &options, &first, &names);
    let range = (!predicted.ranges_m.is_empty())
        .then(|| prediction(&predicted.ranges_m, "ranges of stations left out", &with_image, &with_ranges));
    Ok(HoldOut {
        stations: names.iter().map(|name| (*name).to_owned()).collect(),
        image: prediction(&predicted.pixels, "image points of stations left out", &first, &with_image),
        range,
    })
}

fn adjusted(network: &Network, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
    network.validate()?;
    let known = |name: &&String| network.stations.iter().any(|station| station.name == **name);
    let without_ranges = options.without_ranges.iter().filter(known).cloned().collect();
    let options = CalibrationOptions { without_ranges, ..options.clone() };
    Problem { network, lens: None, options: &options, robust: false }.calibrate()
}

/// The test of what the second adjustment has beyond the first.
fn prediction(
    differences: &[f64],
    subject: &str,
    before: &CalibrationOutcome,
    after: &CalibrationOutcome,
) -> Prediction {
    // Automatic terms may be others without some stations: then the one adjustment is no part of the other.
    let terms = |outcome: &CalibrationOutcome| -> BTreeSet<String> {
        outcome.estimated.iter().map(|name| name.split('@').next().unwrap_or(name).to_owned()).collect()
    };
    let degrees = if terms(before) == terms(after) { (after.redundancy - before.redundancy) as f64 } else { f64::NAN };
    Prediction::new(differences, subject, (after.vtpv - before.vtpv, degrees), LEVEL)
}

/// Observed minus predicted.
#[derive(Default)]
struct Differences {
    pixels: Vec<f64>,
    ranges_m: Vec<f64>,
}

/// What a calibration predicts of stations that it has not seen, at the poses that their image points give.
fn predictions(
    network: &Network,
    options: &CalibrationOptions,
    calibration: &CalibrationOutcome,
    names: &BTreeSet<&str>,
) -> Differences {
    let points: BTreeMap<&str, Point3<f64>> =
        calibration.targets.iter().map(|target| (target.name.as_str(), target.point)).collect();
    let mut all = Differences::default();
    for (index, station) in network.stations.iter().enumerate().filter(|(_, s)| names.contains(s.name.as_str())) {
        let own = network.sightings.iter().filter(|seen| seen.station == index);
        let seen: Vec<(&Sighting, TargetObservation)> = own
            .filter_map(|seen| {
                let point = *points.get(network.targets[seen.target].name.as_str())?;
                let observed = TargetObservation::new(point, seen.pixel?, 1.0);
                Some((seen, TargetObservation { sigma_pixel: seen.sigma_pixel, ..observed }))
            })
            .collect();
        let targets: Vec<TargetObservation> = seen.iter().map(|(_, target)| *target).collect();
        if targets.len() <= NEEDED {
            continue;
        }
        let Ok(pose) = robust_resection(&calibration.camera, &targets) else { continue };
        for (sighting, target) in &seen {
            if let Some(modelled) = modelled_pixel(&calibration.camera, &pose, &target.point) {
                all.pixels.extend([target.pixel[0] - modelled[0], target.pixel[1] - modelled[1]]);
            }
            let ranged = !options.without_ranges.contains(&station.name);
            all.ranges_m.extend(
                ranged.then(|| range_difference(calibration, station, sighting, &target.point, &pose)).flatten(),
            );
        }
    }
    all
}

/// A corrected range less the distance of a point; `None` without a range or image point, and where the calibration has no terms of the
/// station's integration time.
pub fn range_difference(
    calibration: &CalibrationOutcome,
    station: &crate::Station,
    seen: &Sighting,
    point: &Point3<f64>,
    world_from_camera: &Isometry3<f64>,
) -> Option<f64> {
    let same = |time: &Option<f64>| time.map(f64::to_bits) == station.integration_time_s.map(f64::to_bits);
    let (_, model) = calibration.range_models.iter().find(|(time, _)| same(time))?;
    let camera = &calibration.camera;
    let [x, y] = camera.format.image_from_pixel(seen.pixel?);
    let [xp, yp] = camera.interior.principal_point_mm;
    let corrected = model.corrected_range(seen.range_m?, x - xp, y - yp, seen.amplitude.unwrap_or(f64::NAN));
    let difference = corrected - station.drift_m - (point.coords - world_from_camera.translation.vector).norm();
    difference.is_finite().then_some(difference)
}

/// The network without what a calibration of it rejected: a sighting goes as a whole, as a range needs its image point.
fn without_rejected(network: &Network, outcome: &CalibrationOutcome) -> Network {
    let rejected = |kinds: [Component; 3]| -> BTreeSet<(&str, &str)> {
        let of = |quality: &&crate::ObservationQuality| {
            quality.verdict == Verdict::Rejected && kinds.contains(&quality.component)
        };
        outcome.residuals.iter().filter(of).map(|q| (q.station.as_str(), q.target.as_str())).collect()
    };
    let sightings = rejected([Component::Col, Component::Row, Component::Range]);
    let passive = rejected([Component::PassiveCol, Component::PassiveRow, Component::PassiveRow]);
    let distances = rejected([Component::Distance; 3]);
    let pair = |station: usize, target: usize| {
        (network.stations[station].name.as_str(), network.targets[target].name.as_str())
    };
    let control = rejected([Component::Control; 3]);
    let mut kept = network.clone();
    for target in kept.targets.iter_mut().filter(|target| control.contains(&("", target.name.as_str()))) {
        target.covariance = None;
    }
    for station in kept.stations.iter_mut().filter(|station| control.contains(&(station.name.as_str(), ""))) {
        station.covariance = None;
    }
    kept.distances.retain(|known| !distances.contains(&(network.end_name(known.from), network.end_name(known.to))));
    if let Some(camera) = &mut kept.passive {
        camera.image_points.retain(|point| !passive.contains(&pair(point.station, point.target)));
    }
    reduced(&kept, |_| true, |seen| !sightings.contains(&pair(seen.station, seen.target)))
}

/// The network of the stations and sightings kept, without targets that these no longer determine.
fn reduced(
    network: &Network,
    keep_station: impl Fn(&str) -> bool,
    keep_sighting: impl Fn(&Sighting) -> bool,
) -> Network {
    let station_stays: Vec<bool> = network.stations.iter().map(|station| keep_station(&station.name)).collect();
    let stays = |seen: &&Sighting| station_stays[seen.station] && keep_sighting(seen);
    let ends = |known: &crate::KnownDistance| {
        [known.from, known.to].iter().all(|end| !matches!(end, DistanceEnd::Station(k) if !station_stays[*k]))
    };
    let mut seen_from: Vec<BTreeSet<(bool, usize)>> = vec![BTreeSet::new(); network.targets.len()];
    for seen in network.sightings.iter().filter(stays) {
        seen_from[seen.target].insert((false, seen.station));
    }
    let passive = network.passive.iter().flat_map(|passive| &passive.image_points);
    for point in passive.filter(|point| station_stays[point.station]) {
        seen_from[point.target].insert((true, point.station));
    }
    let mut target_stays: Vec<bool> = network
        .targets
        .iter()
        .zip(&seen_from)
        .map(|(target, from)| from.len() >= 2 || target.covariance.is_some())
        .collect();
    for known in network.distances.iter().filter(|known| ends(known)) {
        for end in [known.from, known.to] {
            if let DistanceEnd::Target(index) = end {
                target_stays[index] = target_stays[index] || !seen_from[index].is_empty();
            }
        }
    }
    let places = |stays: &[bool]| -> Vec<usize> {
        stays
            .iter()
            .scan(0, |next, stays| {
                let place = *next;
                *next += usize::from(*stays);
                Some(place)
            })
            .collect()
    };
    let (stations, targets) = (places(&station_stays), places(&target_stays));
    let end = |end: DistanceEnd| match end {
        DistanceEnd::Station(index) => station_stays[index].then(|| DistanceEnd::Station(stations[index])),
        DistanceEnd::Target(index) => target_stays[index].then(|| DistanceEnd::Target(targets[index])),
    };
    let mut kept = network.clone();
    let mut index = 0..;
    kept.stations.retain(|_| index.next().is_some_and(|k: usize| station_stays[k]));
    let mut index = 0..;
    kept.targets.retain(|_| index.next().is_some_and(|k: usize| target_stays[k]));
    kept.sightings = network
        .sightings
        .iter()
        .filter(stays)
        .filter(|seen| target_stays[seen.target])
        .map(|seen| Sighting { station: stations[seen.station], target: targets[seen.target], ..*seen })
        .collect();
    kept.distances = network
        .distances
        .iter()
        .filter_map(|known| Some(crate::KnownDistance { from: end(known.from)?, to: end(known.to)?, ..*known }))
        .collect();
    if let Some(camera) = &mut kept.passive {
        camera.image_points.retain(|point| station_stays[point.station] && target_stays[point.target]);
        for point in &mut camera.image_points {
            (point.station, point.target) = (stations[point.station], targets[point.target]);
        }
    }
    kept
}
