//! Start values: poses and coordinates from whatever is known, gross errors among the observations or not.

use std::collections::{BTreeMap, BTreeSet};

use camera_model::{euler_from_pose, pose_from_euler};
use nalgebra::Isometry3;

use crate::functional_model::misfit::{Misfit, misfits};
use crate::functional_model::setup::{Calibration, Datum, Excluded, Setup, Start};
use crate::start_values::settle::{start_limit, start_range_limit};
use crate::start_values::start_calibration::start_calibration;
use crate::start_values::start_finder::Finder;
use crate::{Network, Result};

/// Share of the image points that start values may miss before others are looked for.
const MISSED: f64 = 0.2;

/// Attitudes nearer than this are one, radian: approximate ones are off by less, others by more.
const SAME_ATTITUDE: f64 = 0.1;

/// Which of the approximate values that are given are taken. Control is among them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Trust {
    pub(crate) stations: bool,
    pub(crate) targets: bool,
}

impl<'n> Setup<'n> {
    /// The adjustment of a network with these terms estimated, by their canonical names, from start values that are given
    /// or found. `ranged` says of each station whether its ranges take part, `passive` whether the passive camera does.
    ///
    /// Nothing is left out, and of the terms nothing is known before.
    ///
    /// # Errors
    /// [`Error::TooFewSightings`](crate::Error::TooFewSightings) and [`Error::NotReachable`](crate::Error::NotReachable).
    pub fn from_network(
        network: &'n Network,
        estimated: BTreeSet<String>,
        ranged: Vec<bool>,
        passive: bool,
        datum: Datum,
    ) -> Result<Self> {
        network.check_coverage(&ranged, passive)?;
        let calibration = start_calibration(network);
        let (start, unused) = find_start(network, &calibration, passive)?;
        Ok(Self {
            network,
            start,
            unused,
            calibration,
            estimated,
            ranged,
            passive,
            datum,
            geometry_held: false,
            camera_prior: None,
            term_sigmas: BTreeMap::new(),
            excluded: Excluded::default(),
        })
    }
}

/// Finds start values for all stations and all targets that are seen.
///
/// What is given is kept, unless the observations contradict it: then poses, coordinates or both are found anew, whichever
/// fits best. Stations are oriented one after the other, the one with the most known targets first: where
/// it has ranges, by absolute orientation of the points that image points and ranges make; else by resection. Targets
/// follow from oriented stations as the median of their points, or as the intersection of rays. Where nothing at all
/// is given, the station with the most ranges becomes the origin; without ranges, stations are oriented relative to each other by
/// their image points, and the first of these is the origin.
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
pub fn fits_as_given(network: &Network) -> bool {
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
    Ok(Start { stations, targets: finder.targets, relative, mounting: None })
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
