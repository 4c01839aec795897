//! The files of a tracked sequence.

use atomic_output::{Destination, write_text};
use commands::{Progress, json, words_by_subject};
use nalgebra::Isometry3;
use pipeline::Result;
use range_io::clouds::{CloudFile, Precision};
use range_io::ply::write_cloud;
use range_io::tables::{Station, write_stations};
use range_io::trajectory::{StampedPose, write_tum};

use crate::track::document::document;
use crate::track::figures::Figures;
use crate::track::outcome::{FramePose, Tracked, TrackedFrame};

/// Writes everything, which appears when the last file is complete.
pub(crate) fn write(destination: &Destination, tracked: &Tracked, progress: &dyn Progress) -> Result<()> {
    progress.begin("write results", 4);
    let page = document(&tracked.summary, Figures::new(tracked)?);
    let folder = destination.open()?;
    write_cloud(folder.file("cloud.ply")?, &map(tracked), Precision::Single)?;
    progress.advance(1);
    write_tum(folder.file("trajectory.txt")?, &trajectory(&tracked.poses, |pose| pose.tracked))?;
    write_tum(folder.file("trajectory_adjusted.txt")?, &trajectory(&tracked.poses, |pose| pose.adjusted))?;
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
fn trajectory(poses: &[FramePose], world_from_camera: fn(&FramePose) -> Isometry3<f64>) -> Vec<StampedPose> {
    let known = poses.iter().filter(|pose| pose.is_known);
    let stamped =
        |pose: &FramePose| StampedPose { timestamp_s: pose.timestamp_s, world_from_camera: world_from_camera(pose) };
    known.map(stamped).collect()
}

fn stations(tracked: &Tracked) -> Vec<Station> {
    let frames = tracked.summary.per_frame.iter().zip(&tracked.poses);
    let doubts = words_by_subject(&tracked.summary.doubts);
    let known = frames.filter(|(_, pose)| pose.is_known);
    let row = |(frame, pose): (&TrackedFrame, &FramePose)| Station {
        station: frame.name.clone(),
        world_from_camera: pose.tracked,
        sigma_position_m: pose.sigmas.map(|sigmas| sigmas.0),
        sigma_attitude_rad: pose.sigmas.map(|sigmas| sigmas.1),
        doubt: doubts.get(frame.name.as_str()).cloned(),
    };
    known.map(row).collect()
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
