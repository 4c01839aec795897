//! Turns a point cloud or a trajectory of any form that is read into one that is written:
//! `cargo run -p range-io --example convert -- scan.pcd scan.ply`, `... -- poses.log poses.tum`.
#![allow(clippy::print_stdout)]

use std::path::PathBuf;

use range_io::clouds::{Precision, read_any_cloud, write_any_cloud};
use range_io::trajectory::{TrajectoryFormat, read_any_trajectory, write_any_trajectory};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (from, to) = arguments.next().zip(arguments.next()).ok_or("expected a file to read and one to write")?;
    let form = match to.extension().and_then(|ending| ending.to_str()) {
        Some("tum" | "txt") => Some(TrajectoryFormat::Tum),
        Some("kitti") => Some(TrajectoryFormat::Kitti),
        Some("csv") => Some(TrajectoryFormat::Euroc),
        _ => None,
    };
    if let Some(form) = form {
        let poses = read_any_trajectory(&from)?;
        write_any_trajectory(&to, &poses, form)?;
        println!("{} poses", poses.len());
        return Ok(());
    }
    let cloud = read_any_cloud(&from)?;
    // Most readers of PCD take positions of single precision only.
    let is_pcd = to.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("pcd"));
    let precision = if is_pcd { Precision::Single } else { Precision::Double };
    write_any_cloud(&to, &cloud, precision)?;
    println!("{} points, size {:?}, pose {:?}", cloud.len(), cloud.size, cloud.world_from_cloud);
    Ok(())
}
