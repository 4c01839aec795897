//! Two results held against each other: clouds, or poses.

use std::fmt;
use std::path::{Path, PathBuf};

use icp_registration::NeighbourTree;
use nalgebra::Isometry3;
use nalgebra::Point3;
use range_io::ply::read_cloud;
use range_io::tables::read_stations;
use range_io::trajectory::read_tum;
use serde::Serialize;

use crate::statistics::quantile;
use crate::{Error, Result};

/// How two results differ.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Comparison {
    /// Distances of the first cloud's points to the second cloud.
    pub clouds: Option<CloudComparison>,
    /// Differences of poses of the same name or time.
    pub poses: Option<PoseComparison>,
}

/// Distances from one cloud to the other.
#[derive(Debug, Clone, Serialize)]
pub struct CloudComparison {
    /// Points of the first cloud that were compared.
    pub points: usize,
    /// Median distance to the nearest point of the second cloud, metre.
    pub distance_median_m: f64,
    /// 95 % of the distances are below this, metre.
    pub distance_p95_m: f64,
    /// Largest distance, metre.
    pub distance_max_m: f64,
}

/// Differences of poses.
#[derive(Debug, Clone, Serialize)]
pub struct PoseComparison {
    /// Poses that both have.
    pub poses: usize,
    /// Root mean square difference of the positions, metre.
    pub position_rms_m: f64,
    /// Largest difference of the positions, metre.
    pub position_max_m: f64,
    /// Largest difference of the attitudes, degree.
    pub attitude_max_deg: f64,
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut lines = Vec::new();
        if let Some(clouds) = &self.clouds {
            lines.push(format!(
                "clouds: {} points, nearest point of the other: median {:.2} mm, 95 % below {:.2} mm, at most {:.1} mm",
                clouds.points,
                1e3 * clouds.distance_median_m,
                1e3 * clouds.distance_p95_m,
                1e3 * clouds.distance_max_m
            ));
        }
        if let Some(poses) = &self.poses {
            lines.push(format!(
                "poses: {} in common, position rms {:.2} mm, at most {:.2} mm, attitude at most {:.4} degrees",
                poses.poses,
                1e3 * poses.position_rms_m,
                1e3 * poses.position_max_m,
                poses.attitude_max_deg
            ));
        }
        f.write_str(&lines.join("\n"))
    }
}

/// Compares two output folders, two `.ply` clouds, two `stations.csv` or two `trajectory.txt`.
pub fn compare(first: &Path, second: &Path) -> Result<Comparison> {
    if first.is_dir() && second.is_dir() {
        let both = |name: &str| (first.join(name), second.join(name));
        let (a, b) = both("cloud.ply");
        let clouds = if a.is_file() && b.is_file() { Some(compare_clouds(&a, &b)?) } else { None };
        let (a, b) = both("stations.csv");
        return Ok(Comparison { clouds, poses: Some(compare_poses(&a, &b)?) });
    }
    let kind = |path: &Path| path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match (kind(first).as_deref(), kind(second).as_deref()) {
        (Some("ply"), Some("ply")) => Ok(Comparison { clouds: Some(compare_clouds(first, second)?), poses: None }),
        (Some("csv" | "txt"), Some("csv" | "txt")) => {
            Ok(Comparison { clouds: None, poses: Some(compare_poses(first, second)?) })
        }
        _ => Err(Error::Compare(format!(
            "{} and {}: expected two folders, two clouds (.ply) or two sets of poses (.csv, .txt)",
            first.display(),
            second.display()
        ))),
    }
}

fn compare_clouds(first: &Path, second: &Path) -> Result<CloudComparison> {
    let reference = NeighbourTree::new(&unflagged(second)?);
    let reference = reference.map_err(|error| Error::Compare(format!("{}: {error}", second.display())))?;
    let points = unflagged(first)?;
    let mut distances = Vec::with_capacity(points.len());
    for point in &points {
        let nearest = reference.nearest(point);
        let nearest = nearest.map_err(|error| Error::Compare(format!("{}: {error}", first.display())))?;
        distances.push(nearest.distance_m);
    }
    Ok(CloudComparison {
        points: points.len(),
        distance_median_m: quantile(&mut distances, 0.5),
        distance_p95_m: quantile(&mut distances, 0.95),
        distance_max_m: quantile(&mut distances, 1.0),
    })
}

fn unflagged(path: &Path) -> Result<Vec<Point3<f64>>> {
    let cloud = read_cloud(path)?;
    let keep = |index: usize| cloud.flags.as_ref().is_none_or(|flags| flags[index] == 0);
    Ok(cloud.points.iter().enumerate().filter(|(index, _)| keep(*index)).map(|(_, p)| Point3::from(*p)).collect())
}

/// A pose and what it is matched by.
type Named = (String, Isometry3<f64>);

fn read_poses(path: &Path) -> Result<Vec<Named>> {
    if path.extension().is_some_and(|ending| ending == "txt") {
        let poses = read_tum(path)?;
        return Ok(poses
            .into_iter()
            .map(|pose| (format!("{:.6}", pose.timestamp_s), pose.world_from_camera))
            .collect());
    }
    Ok(read_stations(path)?.into_iter().map(|row| (row.station, row.world_from_camera)).collect())
}

fn compare_poses(first: &Path, second: &Path) -> Result<PoseComparison> {
    let (ours, reference) = (read_poses(first)?, read_poses(second)?);
    let mut positions = Vec::new();
    let mut attitude_max = 0.0_f64;
    for (name, pose) in &ours {
        if let Some((_, other)) = reference.iter().find(|(candidate, _)| candidate == name) {
            positions.push((pose.translation.vector - other.translation.vector).norm());
            attitude_max = attitude_max.max(pose.rotation.angle_to(&other.rotation));
        }
    }
    if positions.is_empty() {
        let paths: [PathBuf; 2] = [first.to_owned(), second.to_owned()];
        return Err(Error::Compare(format!(
            "{} and {} have no pose in common",
            paths[0].display(),
            paths[1].display()
        )));
    }
    let mean_square = positions.iter().map(|d| d * d).sum::<f64>() / positions.len() as f64;
    Ok(PoseComparison {
        poses: positions.len(),
        position_rms_m: mean_square.sqrt(),
        position_max_m: positions.iter().copied().fold(0.0, f64::max),
        attitude_max_deg: attitude_max.to_degrees(),
    })
}
