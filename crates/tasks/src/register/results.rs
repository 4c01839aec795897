//! The files of a registration.

use atomic_output::{Destination, write_text};
use commands::{Progress, json, tiles, words_by_subject};
use pipeline::Result;
use pipeline::stations::Station;
use range_io::clouds::{CloudFile, Precision};
use range_io::ply::write_cloud;
use range_io::tables::{Station as StationRow, write_stations};
use range_io::trajectory::{StampedPose, write_tum};

use crate::register::Registered;
use crate::register::document::{Figures, document};

/// Writes everything, which appears when the last file is complete.
pub(crate) fn write(destination: &Destination, registered: &mut Registered, progress: &dyn Progress) -> Result<()> {
    progress.begin("write results", 5);
    let folder = destination.open()?;
    let cloud = merged(registered);
    write_cloud(folder.file("cloud.ply")?, &cloud, Precision::Single)?;
    let points = cloud.points.len() as u64;
    drop(cloud);
    registered.summary.tiles = tiles::of_cloud(&folder, "cloud", points)?;
    let registered = &*registered;
    let page = document(&registered.summary, Figures::new(registered)?);
    progress.advance(1);
    let known = || registered.stations.iter().zip(&registered.poses);
    let doubts = words_by_subject(&registered.summary.doubts);
    let rows: Vec<StationRow> = known()
        .map(|(station, pose)| StationRow {
            station: station.name.clone(),
            world_from_camera: pose.world_from_camera,
            sigma_position_m: pose.sigmas().map(|sigmas| sigmas.0),
            sigma_attitude_rad: pose.sigmas().map(|sigmas| sigmas.1),
            doubt: doubts.get(station.name.as_str()).cloned(),
        })
        .collect();
    write_stations(folder.file("stations.csv")?, &rows)?;
    progress.advance(2);
    let poses: Vec<StampedPose> = known()
        .map(|(station, pose)| StampedPose {
            timestamp_s: station.timestamp_s,
            world_from_camera: pose.world_from_camera,
        })
        .collect();
    write_tum(folder.file("trajectory.txt")?, &poses)?;
    progress.advance(3);
    write_text(folder.file("summary.json")?, &json(&registered.summary)?)?;
    progress.advance(4);
    write_text(folder.file("report.html")?, &page.html())?;
    progress.advance(5);
    folder.commit()?;
    Ok(())
}

/// All finite points of the stations whose pose is known, in the common frame, flagged ones with their flags.
fn merged(registered: &Registered) -> CloudFile {
    let mut file = CloudFile::default();
    let (mut intensity, mut sigma, mut flags, mut frame) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (number, (station, pose)) in registered.stations.iter().zip(&registered.poses).enumerate() {
        let Station { file: own, .. } = station;
        for (index, point) in own.points.iter().enumerate() {
            if !point.iter().all(|x| x.is_finite()) {
                continue;
            }
            let moved = pose.world_from_camera * nalgebra::Point3::from(*point);
            file.points.push(moved.coords.into());
            intensity.push(own.intensity.as_ref().map_or(f32::NAN, |values| values[index]));
            sigma.push(own.sigma.as_ref().map_or(f32::NAN, |values| values[index]));
            flags.push(own.flags.as_ref().map_or(0, |values| values[index]));
            frame.push(number as u32);
        }
    }
    // An attribute that no input has is left out.
    file.intensity = Some(intensity).filter(|values| values.iter().any(|value| !value.is_nan()));
    file.sigma = Some(sigma).filter(|values| values.iter().any(|value| !value.is_nan()));
    file.flags = Some(flags);
    file.frame = Some(frame);
    file
}
