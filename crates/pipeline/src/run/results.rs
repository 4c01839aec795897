//! The files of a finished run.

use atomic_output::{Destination, OutputFolder, write_text};
use nalgebra::{Isometry3, Point3};
use range_io::ply::{CloudFile, Precision, write_cloud};
use range_io::tables::{Station, write_stations};
use range_io::trajectory::{StampedPose, write_tum};
use serde::Serialize;

use crate::Result;
use crate::command::destination::json;
use crate::command::progress::Progress;
use crate::command::verdict::{Doubt, words_about};
use crate::run::document::document;
use crate::run::figures::Figures;
use crate::run::summary::Summary;
use crate::survey::outcome::{Outcome, StationPose};

/// Writes everything, which appears when the last file is complete.
pub(crate) fn write(
    destination: &Destination,
    outcome: &Outcome,
    summary: &Summary,
    progress: &dyn Progress,
) -> Result<()> {
    progress.begin("write results", 3);
    let page = document(summary, Figures::new(outcome)?).html();
    let folder = destination.open()?;
    match outcome.common_poses() {
        Some(poses) => write_in_common_frame(&folder, outcome, &poses, &summary.doubts)?,
        None => write_in_own_frames(&folder, outcome)?,
    }
    progress.advance(1);
    write_text(folder.file("summary.json")?, &json(summary)?)?;
    progress.advance(2);
    write_text(folder.file("report.html")?, &page)?;
    folder.commit()?;
    progress.advance(3);
    Ok(())
}

/// One cloud, and where the stations stand in its frame.
fn write_in_common_frame(
    folder: &OutputFolder,
    outcome: &Outcome,
    poses: &[StationPose],
    doubts: &[Doubt],
) -> Result<()> {
    if !outcome.clouds.is_empty() {
        let views: Vec<(usize, Isometry3<f64>)> = poses.iter().map(|pose| pose.world_from_camera).enumerate().collect();
        write_cloud(folder.file("cloud.ply")?, &cloud_file(outcome, &views), Precision::Single)?;
    }
    write_stations(folder.file("stations.csv")?, &station_rows(outcome, poses, doubts))?;
    let stamped = outcome
        .views
        .iter()
        .zip(poses)
        .map(|(view, pose)| StampedPose { timestamp_s: view.timestamp_s, world_from_camera: pose.world_from_camera });
    write_tum(folder.file("trajectory.txt")?, &stamped.collect::<Vec<_>>())?;
    Ok(())
}

/// The cloud of each view in its camera's frame. There are no poses to write.
fn write_in_own_frames(folder: &OutputFolder, outcome: &Outcome) -> Result<()> {
    for (view, cloud) in own_clouds(outcome).iter().enumerate() {
        let cloud_of_view = cloud_file(outcome, &[(view, Isometry3::identity())]);
        write_cloud(folder.file(&cloud.file)?, &cloud_of_view, Precision::Single)?;
    }
    Ok(())
}

/// The file of a cloud that is in no frame but its camera's.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct OwnCloud {
    /// Station, and frame or number of frames.
    pub view: String,
    /// The file, relative to the output folder; x right, y up, the camera looking along -z.
    pub file: String,
}

/// Files of the views' clouds where there is no frame that they have in common.
pub(crate) fn own_clouds(outcome: &Outcome) -> Vec<OwnCloud> {
    if outcome.common_poses().is_some() {
        return Vec::new();
    }
    let cloud = |(index, (view, _)): (usize, (&crate::View, _))| {
        // A station's name may hold what no file's name can.
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        let station: String = view.station.chars().take(LONGEST_NAME).map(plain).collect();
        OwnCloud { view: view.name(), file: format!("clouds/{index:03}_{station}.ply") }
    };
    outcome.views.iter().zip(&outcome.clouds).enumerate().map(cloud).collect()
}

/// Characters of a station's name in a file's name.
const LONGEST_NAME: usize = 100;

/// All finite points of some views, each moved by its pose, flagged ones with their flags, and those of split pixels.
fn cloud_file(outcome: &Outcome, views: &[(usize, Isometry3<f64>)]) -> CloudFile {
    let mut file = CloudFile::default();
    let (mut intensity, mut sigma, mut flags, mut frame) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (number, pose) in views {
        let Some(cloud) = outcome.clouds.get(*number) else { continue };
        for index in 0..cloud.points.len() {
            if !cloud.points[index].iter().all(|x| x.is_finite()) {
                continue;
            }
            file.points.push((pose * Point3::from(cloud.points[index])).coords.into());
            intensity.push(cloud.amplitude[index]);
            sigma.push(cloud.sigma[index]);
            flags.push(cloud.flags[index].bits());
            frame.push(*number as u32);
        }
    }
    for further in &outcome.further_points {
        let Some((_, pose)) = views.iter().find(|(number, _)| *number == further.view) else { continue };
        file.points.push((pose * Point3::from(further.point)).coords.into());
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

fn station_rows(outcome: &Outcome, poses: &[StationPose], doubts: &[Doubt]) -> Vec<Station> {
    let rows = outcome.views.iter().zip(poses);
    rows.map(|(view, pose)| Station {
        station: view.station.clone(),
        world_from_camera: pose.world_from_camera,
        sigma_position_m: pose.sigmas().map(|sigmas| sigmas.0),
        sigma_attitude_rad: pose.sigmas().map(|sigmas| sigmas.1),
        doubt: words_about(doubts, &view.station),
    })
    .collect()
}
