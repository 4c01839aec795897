use multiview_registration::{Datum, PairAlignment, RefusedPair, Start, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;
use point_cloud::Cloud;
use rayon::prelude::*;

use crate::command::progress::Progress;
use crate::plan::{RegisterOptions, StartPoses};
use crate::stages::Findings;
use crate::stations::refused::{self, Tried};
use crate::stations::station::{Station, Windows};
use crate::stations::surface::{self, Surface};
use crate::survey::outcome::StationPose;
use crate::survey::work::Work;
use crate::{Error, Result};

/// What was found.
struct Found {
    poses: Vec<Isometry3<f64>>,
    pairs: Vec<PairAlignment>,
    refused: Vec<RefusedPair>,
    clouds: Vec<Cloud>,
}

/// All stations are brought together from what is known of their poses.
pub(crate) fn run(work: &mut Work, options: &RegisterOptions, progress: &dyn Progress) -> Result<Findings> {
    if work.outcome.clouds.is_empty() {
        return Err(Error::Needs { stage: "Register", needs: "PointCloud" });
    }
    let stations = Station::of_views(&work.outcome);
    progress.begin("Register", stations.len());
    let found = match options.start {
        StartPoses::Neighbour => each_onto_the_one_before(&stations, options)?,
        StartPoses::Approximate => {
            let approximate: Option<Vec<Isometry3<f64>>> = stations.iter().map(|station| station.approximate).collect();
            at_once(&stations, approximate.as_deref().map_or(Start::Order, Start::Poses), options, progress)?
        }
        StartPoses::Order => at_once(&stations, Start::Order, options, progress)?,
    };
    // The first station is where the survey says it is.
    let here = stations.first().and_then(|station| station.approximate).zip(found.poses.first());
    let world = here.map_or_else(Isometry3::identity, |(stated, found)| stated * found.inverse());
    let pose = |pose: &Isometry3<f64>| StationPose { world_from_camera: world * pose, covariance: None };
    work.outcome.poses = found.poses.iter().map(pose).collect();
    let findings = [("pairs", found.pairs.len()), ("pairs_refused", found.refused.len())];
    (work.outcome.pairs, work.outcome.refused, work.station_clouds) = (found.pairs, found.refused, found.clouds);
    Ok(findings.map(|(name, count)| (name.to_owned(), count as f64)).into())
}

fn at_once(
    stations: &[Station],
    start: Start<'_>,
    options: &RegisterOptions,
    progress: &dyn Progress,
) -> Result<Found> {
    let windows = Windows::of_start(matches!(start, Start::Poses(_)));
    let clouds = stations.par_iter().map(|station| station.cloud(options.normal_half_width_px, windows));
    let clouds = clouds.collect::<Result<Vec<Cloud>>>()?;
    let choice = StationRegistrationOptions {
        minimum_overlap: options.minimum_overlap,
        start_error_m: Some(options.maximum_distance_m),
        ..StationRegistrationOptions::default()
    };
    let told = |done: usize, _: usize| progress.advance(done);
    let found = register_stations(&clouds, start, Datum::Station(0), &choice, &told);
    let names: Vec<String> = stations.iter().map(|station| station.name.clone()).collect();
    let tried = match start {
        Start::Poses(_) => Tried::Poses(Some(options.maximum_distance_m)),
        Start::Order => Tried::Order,
        Start::Nothing => Tried::AllPairs,
    };
    let found = found.map_err(|error| refused::of_stage("Register", error, &names, tried))?;
    Ok(Found { poses: found.world_from_station, pairs: found.pairs, refused: found.refused, clouds })
}

fn each_onto_the_one_before(stations: &[Station], options: &RegisterOptions) -> Result<Found> {
    let surfaces = stations.par_iter().map(|station| Surface::new(station, options.normal_half_width_px));
    let surfaces = surfaces.collect::<Result<Vec<_>>>()?;
    let align = |source: usize| {
        let target = source - 1;
        let start = surface::Start::Found(Isometry3::identity(), options.maximum_distance_m);
        let result = surfaces[target].align(&surfaces[source], start);
        let names = format!("{} onto {}", stations[source].name, stations[target].name);
        let result = result.map_err(Error::stage("Register", &names))?;
        Ok(PairAlignment { target, source, result })
    };
    let pairs = (1..stations.len()).into_par_iter().map(align).collect::<Result<Vec<_>>>()?;
    let mut poses = vec![Isometry3::identity()];
    for pair in &pairs {
        poses.push(poses[pair.target] * pair.result.target_from_source);
    }
    let clouds = surfaces.into_iter().map(|surface| surface.target.cloud().clone()).collect();
    Ok(Found { poses, pairs, refused: Vec::new(), clouds })
}
