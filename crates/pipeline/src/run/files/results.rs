//! The files of a finished run beside its clouds.

use atomic_output::{OutputFolder, write_text};
use range_io::tables::{Station, write_stations};
use range_io::trajectory::{StampedPose, write_tum};

use crate::Result;
use crate::run::summary::Summary;
use crate::survey::records::{StationPose, ViewRecord};
use commands::Progress;
use commands::json;
use commands::words_by_subject;

/// Writes where the views stand in the frame that they have in common.
pub(crate) fn write_poses(
    folder: &OutputFolder,
    views: &[ViewRecord],
    poses: &[StationPose],
    summary: &Summary,
) -> Result<()> {
    let doubts = words_by_subject(&summary.doubts);
    let row = |(view, pose): (&ViewRecord, &StationPose)| Station {
        station: view.station.clone(),
        world_from_camera: pose.world_from_camera,
        sigma_position_m: pose.sigmas().map(|sigmas| sigmas.0),
        sigma_attitude_rad: pose.sigmas().map(|sigmas| sigmas.1),
        doubt: doubts.get(view.station.as_str()).cloned(),
    };
    let rows: Vec<Station> = views.iter().zip(poses).map(row).collect();
    write_stations(folder.file("stations.csv")?, &rows)?;
    let stamped: Vec<StampedPose> = std::iter::zip(views, poses)
        .map(|(view, pose)| StampedPose { timestamp_s: view.timestamp_s, world_from_camera: pose.world_from_camera })
        .collect();
    Ok(write_tum(folder.file("trajectory.txt")?, &stamped)?)
}

/// Writes summary and page; then everything appears.
pub(crate) fn finish(folder: OutputFolder, summary: &Summary, page: &str, progress: &dyn Progress) -> Result<()> {
    write_text(folder.file("summary.json")?, &json(summary)?)?;
    progress.advance(2);
    write_text(folder.file("report.html")?, page)?;
    folder.commit()?;
    progress.advance(3);
    progress.finish();
    Ok(())
}
