//! The files of a tracked sequence.

use atomic_output::{Destination, write_text};
use commands::{Progress, json, words_by_subject};
use pipeline::Result;
use range_io::clouds::{CloudFile, Precision};
use range_io::ply::write_cloud;
use range_io::tables::{Station, write_stations};
use range_io::trajectory::{StampedPose, write_tum};
use tracking::TrackedPose;

use crate::track::document::document;
use crate::track::figures::Figures;
use crate::track::outcome::{Tracked, station_pose};

/// Writes everything, which appears when the last file is complete.
pub(crate) fn write(destination: &Destination, tracked: &Tracked, progress: &dyn Progress) -> Result<()> {
    progress.begin("write results", 4);
    let page = document(&tracked.summary, Figures::new(tracked)?);
    let folder = destination.open()?;
    write_cloud(folder.file("cloud.ply")?, &map(tracked), Precision::Single)?;
    progress.advance(1);
    write_tum(folder.file("trajectory.txt")?, &trajectory(&tracked.poses))?;
    write_tum(folder.file("trajectory_adjusted.txt")?, &trajectory(&tracked.adjusted))?;
    write_stations(folder.file("stations.csv")?, &stations(tracked))?;
    progress.advance(2);
    write_text(folder.file("summary.json")?, &json(&tracked.summary)?)?;
    progress.advance(3);
    write_text(folder.file("report.html")?, &page.html())?;
    progress.advance(4);
    folder.commit()?;
    Ok(())
}

/// The frames that have a pose.
fn trajectory(poses: &[TrackedPose]) -> Vec<StampedPose> {
    let known = poses.iter().filter(|pose| pose.state.has_pose());
    known.map(|pose| StampedPose { timestamp_s: pose.timestamp_s, world_from_camera: pose.world_from_camera }).collect()
}

fn stations(tracked: &Tracked) -> Vec<Station> {
    let frames = tracked.summary.per_frame.iter().zip(&tracked.poses);
    let doubts = words_by_subject(&tracked.summary.doubts);
    frames
        .filter_map(|(frame, pose)| {
            let pose = station_pose(pose)?;
            Some(Station {
                station: frame.name.clone(),
                world_from_camera: pose.world_from_camera,
                sigma_position_m: pose.sigmas().map(|sigmas| sigmas.0),
                sigma_attitude_rad: pose.sigmas().map(|sigmas| sigmas.1),
                doubt: doubts.get(frame.name.as_str()).cloned(),
            })
        })
        .collect()
}

fn map(tracked: &Tracked) -> CloudFile {
    let cloud = &tracked.map;
    CloudFile {
        points: cloud.points.iter().map(|point| point.coords.into()).collect(),
        normals: cloud.normals.as_ref().map(|normals| normals.iter().map(|n| [0, 1, 2].map(|k| n[k] as f32)).collect()),
        sigma: cloud.sigma.as_ref().map(|sigma| sigma.iter().map(|value| *value as f32).collect()),
        ..CloudFile::default()
    }
}
