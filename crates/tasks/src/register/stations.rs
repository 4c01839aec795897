//! All stations at once.

use std::collections::BTreeMap;

use commands::plan::NORMAL_HALF_WIDTH_PX;
use commands::{Doubt, DoubtKind, Progress};
use multiview_registration::Error::UnconnectedStations;
use multiview_registration::{PairAlignment, Start, StationRegistration, SurfacePair};
use nalgebra::{Isometry3, Point3};
use pipeline::stations::{MOST_TRIED, Station, Tried, Windows, poses_in, refused, register_at_once};
use pipeline::survey::StationPose;
use pipeline::{Error, Result};
use point_cloud::Cloud;
use rayon::prelude::*;

use crate::register::input::Input;
use crate::register::summary::{RegisterSummary, RegisteredLoop, RegisteredPair};
use crate::register::{Registered, describe, frames, pairs};

/// A difference between two stations' surfaces in expected standard deviations beyond which it is doubtful.
const LARGEST_SIGMAS: f64 = 5.0;

/// Loops of sound pairs close to within this many times the typical distance of common surfaces.
const LOOSE_LOOP: f64 = 20.0;

pub(crate) fn run(input: Input, start: &str, progress: &dyn Progress) -> Result<Registered> {
    let Input { stations, vertical_axis, turns, .. } = input;
    let before: Option<Vec<Isometry3<f64>>> = stations.iter().map(|station| station.approximate).collect();
    let is_depth_alone = stations.iter().all(Station::is_depth_alone);
    let mut as_frames = is_depth_alone.then(|| frames::found(&stations, before.as_deref())).flatten();
    if let Some(result) = as_frames.take_if(|found| found.unplaced.is_empty()) {
        return frames::registered(stations, before, vertical_axis, &result);
    }
    let clouds_with = |windows: Windows| {
        stations.par_iter().map(|station| station.cloud(NORMAL_HALF_WIDTH_PX, windows)).collect::<Result<Vec<_>>>()
    };
    let clouds = clouds_with(Windows::of_start(before.is_some()))?;
    let (known, tried, words) = match &before {
        Some(poses) => (Start::Poses(poses), Tried::Poses(None), start.to_owned()),
        None if stations.len() <= MOST_TRIED => (Start::Nothing, Tried::AllPairs, "none, all pairs tried".to_owned()),
        None => (Start::Order, Tried::Order, "none, stations that follow each other tried".to_owned()),
    };
    let names: Vec<String> = stations.iter().map(|station| station.name.clone()).collect();
    progress.begin("register stations", stations.len());
    let attempt = |clouds: &[Cloud], start: Start<'_>| register_at_once(clouds, start, None, &turns, progress);
    let (found, tried, words) = match attempt(&clouds, known) {
        // Free space that noise or wrapped ranges fill speaks against every arrangement; neighbours may still fit.
        Err(UnconnectedStations { stations: lost, to, reasons }) if before.is_none() => match pairs::chained(&stations)
        {
            Some(poses) => {
                let wide = clouds_with(Windows::AsNoiseAsks)?;
                (
                    attempt(&wide, Start::Poses(&poses)),
                    Tried::Chain,
                    "none, each aligned onto the one before".to_owned(),
                )
            }
            None => (Err(UnconnectedStations { stations: lost, to, reasons }), tried, words),
        },
        found => (found, tried, words),
    };
    let misfits = !found.as_ref().is_ok_and(StationRegistration::fits_noise);
    if misfits && !is_depth_alone {
        as_frames = frames::found(&stations, before.as_deref());
    }
    if let Some(result) = as_frames.filter(|_| misfits) {
        return frames::registered(stations, before, vertical_axis, &result);
    }
    let result = found.map_err(|error| refused::of_command(&error, &names, tried))?;
    let poses = poses_in(&Isometry3::identity(), &result);
    let counts: Vec<usize> = clouds.iter().map(Cloud::len).collect();
    // Of hundreds of stations they take more memory than anything that follows.
    drop(clouds);
    let mut summary = summary(&result, &stations, &counts, &poses);
    if before.is_none() {
        summary.doubts.extend(blind_doubt(&result));
    }
    summary.start = words;
    summary.datum = describe::datum(&stations[0], before.is_some());
    describe::extremes(&mut summary);
    let residuals_m = residuals(&result, &stations)?;
    Ok(Registered { stations, poses, before, residuals_m, vertical_axis, summary })
}

fn summary(
    result: &StationRegistration,
    stations: &[Station],
    counts: &[usize],
    poses: &[StationPose],
) -> RegisterSummary {
    let name = |index: usize| stations[index].name.clone();
    let alone: BTreeMap<(usize, usize), &PairAlignment> =
        result.pairs.iter().map(|pair| ((pair.target, pair.source), pair)).collect();
    let mut undetermined = vec![Vec::new(); stations.len()];
    for station in &result.undetermined {
        undetermined[station.station] = station.motions.iter().map(describe::motion).collect();
    }
    let closures = result.loops.iter().map(|closure| RegisteredLoop {
        stations: closure.stations.iter().map(|&station| name(station)).collect(),
        translation_m: closure.translation_m,
        rotation_deg: closure.rotation_rad.to_degrees(),
    });
    let mut rows = describe::stations(stations, poses, counts, undetermined.clone());
    for (row, placement) in rows.iter_mut().zip(&result.placements.stations) {
        row.placement = describe::placement(placement);
    }
    RegisterSummary {
        stations: rows,
        pairs: result.surfaces.iter().map(|pair| row(pair, &alone, stations)).collect(),
        loops: closures.collect(),
        sigma0: result.sigma0,
        redundancy: Some(result.redundancy),
        doubts: doubts(result, stations, &undetermined),
        ..RegisterSummary::default()
    }
}

fn row(pair: &SurfacePair, alone: &BTreeMap<(usize, usize), &PairAlignment>, stations: &[Station]) -> RegisteredPair {
    let alone = alone.get(&(pair.target, pair.source));
    RegisteredPair {
        target: stations[pair.target].name.clone(),
        source: stations[pair.source].name.clone(),
        overlap: pair.overlap,
        rms_m: pair.rms_m,
        mean_m: Some(pair.mean_m),
        undetermined: alone.map_or_else(Vec::new, |pair| pair.result.degenerate.iter().map(describe::motion).collect()),
    }
}

/// What a reader should know before the poses are used.
fn doubts(result: &StationRegistration, stations: &[Station], undetermined: &[Vec<String>]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    if !result.settled {
        let words = format!("after {} rounds the stations still moved: the poses may be off", result.rounds);
        doubts.push(Doubt::new(DoubtKind::Alignment, words));
    }
    for station in result.placements.doubtful() {
        doubts.push(pipeline::stations::wrong_place(&stations[station].name, &result.placements.stations[station]));
    }
    for (station, motions) in stations.iter().zip(undetermined).filter(|(_, motions)| !motions.is_empty()) {
        let motions = motions.join("; ");
        let words = format!("nothing determines {motions}; the start value was kept there");
        doubts.push(Doubt::about(DoubtKind::Alignment, &station.name, words));
    }
    for pair in result.surfaces.iter().filter(|pair| pair.rms_sigma > LARGEST_SIGMAS) {
        let names = format!("{} and {}", stations[pair.source].name, stations[pair.target].name);
        let words = format!(
            "common surfaces are {:.1} mm apart (rms), {:.0} times what their points promise",
            1e3 * pair.rms_m,
            pair.rms_sigma
        );
        doubts.push(Doubt::about(DoubtKind::Alignment, names, words));
    }
    doubts
}

/// Without start poses, pairs that contradict each other are the sign of surfaces that fit in more than one way.
fn blind_doubt(result: &StationRegistration) -> Option<Doubt> {
    let worst = result.loops.iter().map(|closure| closure.translation_m).fold(0.0, f64::max);
    let apart = result.surfaces.iter().map(|pair| pair.rms_m).fold(0.0, f64::max);
    (worst > LOOSE_LOOP * apart).then(|| {
        let words = format!(
            "no start poses were given, and pairs found without them contradict each other (a loop fails to close by \
             {worst:.2} m): the scene may fit in more than one way, and the poses may be wrong as a whole. Give start \
             poses with --guess FILE"
        );
        Doubt::new(DoubtKind::Placement, words)
    })
}

fn residuals(result: &StationRegistration, stations: &[Station]) -> Result<Vec<Vec<f64>>> {
    let of = |(index, station): (usize, &Station)| {
        let points = station.usable_points();
        let finite: Vec<usize> = (0..points.len()).filter(|&k| points[k].iter().all(|x| x.is_finite())).collect();
        let asked: Vec<Point3<f64>> = finite.iter().map(|&k| Point3::from(points[k])).collect();
        let found =
            result.point_residuals(index, &asked).map_err(|error| Error::registration(&station.name, &error))?;
        let mut residuals = vec![f64::NAN; points.len()];
        for (k, value) in finite.into_iter().zip(found) {
            residuals[k] = value;
        }
        Ok(residuals)
    };
    stations.iter().enumerate().map(of).collect()
}
