//! A ring of stations.

use std::path::Path;

use multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use projective_registration::OrganisedFrame;

use crate::Outcome;
use crate::cpu_clock::cpu_seconds;
use crate::files::Frames;
use crate::frames::projection;

/// Prints the root of the mean squared distance of positions, the first station held, and the CPU time of everything.
pub fn run(folder: &Path) -> Outcome {
    let frames = Frames::open(folder)?;
    let starts = frames.other_poses("starts.txt")?;
    let projection = projection(&frames)?;
    let images = (0..starts.len()).map(|k| frames.points(k)).collect::<Result<Vec<_>, _>>()?;
    let start = cpu_seconds();
    let prepared = images.iter().map(|points| Ok(OrganisedFrame::new(&projection, points, None)?.to_cloud()));
    let stations = prepared.collect::<Result<Vec<_>, tracking::Error>>()?;
    let options = StationRegistrationOptions::default();
    let found = register_stations(&stations, Start::Poses(&starts), Datum::Station(0), &options, &|_, _| {})?;
    let milliseconds = 1e3 * (cpu_seconds() - start);
    let relative = |poses: &[nalgebra::Isometry3<f64>], k: usize| (poses[0].inverse() * poses[k]).translation.vector;
    let squares =
        (1..starts.len()).map(|k| (relative(&found.world_from_station, k) - relative(&frames.poses, k)).norm_squared());
    let off = 1e3 * (squares.sum::<f64>() / (starts.len() - 1) as f64).sqrt();
    println!("ours {off} NaN {milliseconds}");
    Ok(())
}
