use multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;

use crate::stages::Findings;
use crate::stages::joining::Joined;
use crate::stations::refused::{self, Tried};
use crate::survey::records::{AdjustmentFigures, StationPose};
use crate::{Error, Result};
use commands::Progress;
use commands::plan::AdjustOptions;

/// All stations are adjusted at once from their surfaces, the first one being the datum.
pub(crate) fn run(joined: &mut Joined, options: &AdjustOptions, progress: &dyn Progress) -> Result<Findings> {
    if joined.clouds.is_empty() {
        return Err(Error::Needs { stage: "Adjust", needs: "Register" });
    }
    let initial: Vec<Isometry3<f64>> = joined.poses.iter().map(|pose| pose.world_from_camera).collect();
    let choice = StationRegistrationOptions {
        minimum_overlap: options.minimum_overlap,
        start_error_m: Some(options.maximum_distance_m),
        ..StationRegistrationOptions::default()
    };
    let tell = |done: usize, total: usize| {
        if done == 1 {
            progress.begin("Adjust", total);
        }
        progress.advance(done);
    };
    let adjusted = register_stations(&joined.clouds, Start::Poses(&initial), Datum::Station(0), &choice, &tell);
    let tried = Tried::Poses(Some(options.maximum_distance_m));
    let adjusted = adjusted.map_err(|error| refused::of_stage("Adjust", error, &joined.names, tried))?;
    if !adjusted.settled {
        return Err(Error::stage("Adjust", "all stations")(format!(
            "the stations still slide after {} rounds: a direction is held by too little; more overlap, or stations \
             that see furniture from the side, are needed",
            adjusted.rounds
        )));
    }
    let poses = adjusted.world_from_station.into_iter().zip(adjusted.covariance);
    joined.poses = poses
        .map(|(world_from_camera, covariance)| StationPose { world_from_camera, covariance: Some(covariance) })
        .collect();
    joined.pairs = adjusted.pairs;
    joined.refused = adjusted.refused;
    let mut findings = Findings::from([
        ("stations_doubtful".to_owned(), adjusted.placements.doubtful().count() as f64),
        ("pairs".to_owned(), adjusted.surfaces.len() as f64),
        ("rounds".to_owned(), adjusted.rounds as f64),
    ]);
    if let Some(sigma0) = adjusted.sigma0 {
        findings.insert("sigma0".to_owned(), sigma0);
    }
    joined.adjustment = Some(AdjustmentFigures {
        sigma0: adjusted.sigma0,
        redundancy: adjusted.redundancy,
        placements: adjusted.placements,
    });
    Ok(findings)
}
