use std::sync::atomic::{AtomicUsize, Ordering};

use icp_registration::{
    Cloud, Datum, IcpTarget, PairAlignment, RefusedPair, Start, StationRegistrationOptions, find_overlaps,
    register_stations,
};
use nalgebra::Isometry3;
use rayon::prelude::*;

use super::Findings;
use crate::outcome::StationPose;
use crate::plan::{RegisterOptions, StartPoses};
use crate::progress::Progress;
use crate::register::Station;
use crate::register::surface::{self, Surface};
use crate::work::Work;
use crate::{Error, Result};

/// Pairs of which a smaller part of the points has a partner are no pairs.
const FEWEST_PARTNERS: f64 = 0.1;

/// Overlapping stations are aligned pair by pair, and the best pairs carry the poses from the first station on.
pub(super) fn run(work: &mut Work, options: &RegisterOptions, progress: &dyn Progress) -> Result<Findings> {
    if work.outcome.clouds.is_empty() {
        return Err(Error::Needs { stage: "Register", needs: "PointCloud" });
    }
    let stations = Station::of_views(&work.outcome);
    let approximate: Option<Vec<Isometry3<f64>>> = stations.iter().map(|station| station.approximate).collect();
    match approximate.filter(|_| options.start == StartPoses::Approximate) {
        Some(approximate) => from_poses(work, &stations, &approximate, options, progress)?,
        None => from_order(work, &stations, options, progress)?,
    }
    let findings = [("pairs", work.outcome.pairs.len()), ("pairs_refused", work.outcome.refused.len())];
    Ok(findings.map(|(name, count)| (name.to_owned(), count as f64)).into())
}

/// Pairs that the approximate poses say overlap, aligned from there.
fn from_poses(
    work: &mut Work,
    stations: &[Station],
    approximate: &[Isometry3<f64>],
    options: &RegisterOptions,
    progress: &dyn Progress,
) -> Result<()> {
    progress.begin("Register", stations.len());
    let done = AtomicUsize::new(0);
    let prepare = |station: &Station| {
        let surface = Surface::new(station, options.normal_half_width_px);
        progress.advance(done.fetch_add(1, Ordering::Relaxed) + 1);
        surface
    };
    let surfaces = stations.par_iter().map(prepare).collect::<Result<Vec<_>>>()?;
    let targets: Vec<&IcpTarget> = surfaces.iter().map(|surface| &surface.target).collect();
    let overlaps = find_overlaps(&targets, approximate, options.maximum_distance_m);
    let overlaps = overlaps.map_err(Error::stage("Register", "overlaps"))?;
    let enough = overlaps.into_iter().filter(|overlap| overlap.fraction >= options.minimum_overlap);
    let candidates: Vec<(usize, usize)> = enough.map(|overlap| (overlap.target, overlap.source)).collect();
    let align = |&(target, source): &(usize, usize)| {
        let guess = surface::Start::Guess(approximate[target].inverse() * approximate[source]);
        let refused = |reason| RefusedPair { target, source, reason };
        let result = surfaces[target].align(&surfaces[source], guess).map_err(|error| refused(error.to_string()))?;
        if result.overlap < FEWEST_PARTNERS {
            return Err(refused(format!("only {:.0} % of the points have a partner", 100.0 * result.overlap)));
        }
        Ok(PairAlignment { target, source, result })
    };
    let (mut pairs, mut refused) = (Vec::new(), Vec::new());
    for aligned in candidates.par_iter().map(align).collect::<Vec<_>>() {
        match aligned {
            Ok(pair) => pairs.push(pair),
            Err(reason) => refused.push(reason),
        }
    }
    work.outcome.poses = spanning_poses(work, &pairs, &refused, approximate)?;
    (work.outcome.pairs, work.outcome.refused) = (pairs, refused);
    work.station_clouds = surfaces.into_iter().map(|surface| surface.target.cloud().clone()).collect();
    Ok(())
}

/// Nothing known but that stations which follow each other overlap.
fn from_order(work: &mut Work, stations: &[Station], options: &RegisterOptions, progress: &dyn Progress) -> Result<()> {
    let clouds = stations.par_iter().map(|station| station.cloud(options.normal_half_width_px));
    let clouds = clouds.collect::<Result<Vec<Cloud>>>()?;
    progress.begin("Register", stations.len());
    let told = |done: usize, _: usize| progress.advance(done);
    let choice = StationRegistrationOptions {
        minimum_overlap: options.minimum_overlap,
        ..StationRegistrationOptions::default()
    };
    let found = register_stations(&clouds, Start::Order, Datum::Station(0), &choice, &told);
    let found = found.map_err(Error::stage("Register", "all stations"))?;
    // The first station keeps the pose that the survey gives it.
    let world = stations.first().and_then(|station| station.approximate).unwrap_or_default();
    let pose = |pose: &Isometry3<f64>| StationPose { world_from_camera: world * pose, covariance: None };
    work.outcome.poses = found.world_from_station.iter().map(pose).collect();
    (work.outcome.pairs, work.outcome.refused) = (found.pairs, found.refused);
    work.station_clouds = clouds;
    Ok(())
}

/// Poses along the tree of pairs with the most overlap, from the first station on.
fn spanning_poses(
    work: &Work,
    pairs: &[PairAlignment],
    refused: &[RefusedPair],
    approximate: &[Isometry3<f64>],
) -> Result<Vec<StationPose>> {
    let mut poses: Vec<Option<StationPose>> = vec![None; approximate.len()];
    if let (Some(first), Some(pose)) = (poses.first_mut(), approximate.first()) {
        *first = Some(StationPose { world_from_camera: *pose, covariance: None });
    }
    let mut order: Vec<&PairAlignment> = pairs.iter().collect();
    // Pairs that determine all six unknowns first, then those with the most overlap.
    order.sort_by(|a, b| {
        let sound = |pair: &PairAlignment| pair.result.degenerate.is_empty();
        sound(b).cmp(&sound(a)).then(b.result.overlap.total_cmp(&a.result.overlap))
    });
    // Each round adds the best pair that leads from a known station to an unknown one.
    while let Some(pair) = order.iter().find(|pair| poses[pair.target].is_some() != poses[pair.source].is_some()) {
        let target_from_source = pair.result.target_from_source;
        if let Some(known) = &poses[pair.target] {
            let world_from_camera = known.world_from_camera * target_from_source;
            poses[pair.source] = Some(StationPose { world_from_camera, covariance: None });
        } else if let Some(known) = &poses[pair.source] {
            let world_from_camera = known.world_from_camera * target_from_source.inverse();
            poses[pair.target] = Some(StationPose { world_from_camera, covariance: None });
        }
    }
    let lost: Vec<String> = poses
        .iter()
        .zip(&work.outcome.views)
        .filter(|(pose, _)| pose.is_none())
        .map(|(_, v)| v.station.clone())
        .collect();
    if lost.is_empty() {
        return Ok(poses.into_iter().flatten().collect());
    }
    let station = |index: usize| work.outcome.views[index].station.as_str();
    let reasons =
        refused.iter().map(|pair| format!("{} to {}: {}", station(pair.source), station(pair.target), pair.reason));
    let reasons: Vec<String> = reasons.collect();
    Err(Error::stage("Register", &format!("stations {}", lost.join(", ")))(format!(
        "no reliable alignment connects them to the first station; more overlap or better approximate poses are needed \
         ({})",
        reasons.join("; ")
    )))
}
