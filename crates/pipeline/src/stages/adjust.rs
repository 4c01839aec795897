use icp_registration::{Datum, PairConstraint, StationAdjustmentOptions, adjust_stations};
use nalgebra::Isometry3;

use super::Findings;
use crate::outcome::{AdjustmentFigures, StationPose};
use crate::progress::Progress;
use crate::work::Work;
use crate::{Error, Result};

/// All stations are adjusted at once, the first one being the datum.
pub(super) fn run(work: &mut Work, progress: &dyn Progress) -> Result<Findings> {
    if work.outcome.pairs.is_empty() {
        return Err(Error::Needs { stage: "Adjust", needs: "Register" });
    }
    let constraints: Vec<PairConstraint> = work
        .outcome
        .pairs
        .iter()
        .map(|pair| PairConstraint {
            target: pair.target,
            source: pair.source,
            target_from_source: pair.result.target_from_source,
            covariance: pair.result.covariance,
        })
        .collect();
    let initial: Vec<Isometry3<f64>> = work.outcome.poses.iter().map(|pose| pose.world_from_camera).collect();
    let options = StationAdjustmentOptions::default();
    let adjusted = adjust_stations(&constraints, &initial, Datum::Station(0), &options);
    let adjusted = adjusted.map_err(Error::stage("Adjust", "all stations"))?;
    progress.advance(1);
    let poses = adjusted.world_from_station.into_iter().zip(adjusted.covariance);
    work.outcome.poses = poses
        .map(|(world_from_camera, covariance)| StationPose { world_from_camera, covariance: Some(covariance) })
        .collect();
    work.outcome.adjustment =
        Some(AdjustmentFigures { sigma0: adjusted.sigma0, redundancy: adjusted.redundancy });
    Ok(Findings::from([("sigma0".to_owned(), adjusted.sigma0), ("redundancy".to_owned(), adjusted.redundancy as f64)]))
}
