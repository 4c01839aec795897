//! The files of a finished run.

use std::path::Path;

use range_io::atomic::OutputFolder;
use range_io::ply::{CloudFile, Precision, write_cloud};
use range_io::tables::{Station, write_stations};
use range_io::trajectory::{StampedPose, write_tum};

use crate::outcome::{Outcome, StationPose};
use crate::progress::Progress;
use crate::summary::Summary;
use crate::verdict::{Doubt, words_about};
use crate::{Error, Result, report};

/// Writes everything into a temporary folder beside `out` and renames it when the last file is complete.
pub(crate) fn write(out: &Path, outcome: &Outcome, summary: &Summary, progress: &dyn Progress) -> Result<()> {
    progress.begin("write results", 5);
    let folder = OutputFolder::create(out)?;
    if !outcome.clouds.is_empty() {
        write_cloud(folder.file("cloud.ply")?, &cloud_file(outcome), Precision::Single)?;
    }
    progress.advance(1);
    write_stations(folder.file("stations.csv")?, &station_rows(outcome, &summary.doubts))?;
    progress.advance(2);
    write_tum(folder.file("trajectory.txt")?, &trajectory(outcome))?;
    progress.advance(3);
    let json = serde_json::to_string_pretty(summary)
        .map_err(|error| Error::Figure { figure: "summary.json".to_owned(), message: error.to_string() })?;
    write_text(&folder.file("summary.json")?, &json)?;
    progress.advance(4);
    write_text(&folder.file("report.html")?, &report::render(outcome, summary)?)?;
    progress.advance(5);
    folder.commit()?;
    Ok(())
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|source| Error::Access { path: path.to_owned(), source })
}

/// All finite points of all views in the world's frame, flagged ones with their flags, and those of split pixels.
fn cloud_file(outcome: &Outcome) -> CloudFile {
    let mut file = CloudFile::default();
    let (mut intensity, mut sigma, mut flags, mut frame) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let poses = poses_or_identity(outcome);
    for (number, (cloud, pose)) in outcome.clouds.iter().zip(&poses).enumerate() {
        for index in 0..cloud.points.len() {
            if !cloud.points[index].iter().all(|x| x.is_finite()) {
                continue;
            }
            let point = pose.world_from_camera * nalgebra::Point3::from(cloud.points[index]);
            file.points.push(point.coords.into());
            intensity.push(cloud.amplitude[index]);
            sigma.push(cloud.sigma[index]);
            flags.push(cloud.flags[index].bits());
            frame.push(number as u32);
        }
    }
    for further in &outcome.further_points {
        let Some(pose) = poses.get(further.view) else { continue };
        let point = pose.world_from_camera * nalgebra::Point3::from(further.point);
        file.points.push(point.coords.into());
        intensity.push(further.amplitude);
        sigma.push(further.sigma_m);
        flags.push(0);
        frame.push(further.view as u32);
    }
    file.intensity = Some(intensity);
    file.sigma = Some(sigma);
    file.flags = Some(flags);
    file.frame = Some(frame);
    file
}

/// Poses of all views: estimated, or as the survey has them, or the camera's own frame.
pub(crate) fn poses_or_identity(outcome: &Outcome) -> Vec<StationPose> {
    if outcome.poses.len() == outcome.views.len() {
        return outcome.poses.clone();
    }
    let known = outcome.views.iter().map(|view| view.approximate_world_from_camera.unwrap_or_default());
    known.map(|world_from_camera| StationPose { world_from_camera, covariance: None }).collect()
}

fn station_rows(outcome: &Outcome, doubts: &[Doubt]) -> Vec<Station> {
    let rows = outcome.views.iter().zip(poses_or_identity(outcome));
    rows.map(|(view, pose)| Station {
        station: view.station.clone(),
        world_from_camera: pose.world_from_camera,
        sigma_position_m: pose.sigmas().map(|sigmas| sigmas.0),
        sigma_attitude_rad: pose.sigmas().map(|sigmas| sigmas.1),
        doubt: words_about(doubts, &view.station),
    })
    .collect()
}

fn trajectory(outcome: &Outcome) -> Vec<StampedPose> {
    let poses = outcome.views.iter().zip(poses_or_identity(outcome));
    poses
        .map(|(view, pose)| StampedPose { timestamp_s: view.timestamp_s, world_from_camera: pose.world_from_camera })
        .collect()
}
