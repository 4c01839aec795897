//! Real scans and their reference poses, read where they lie.
#![allow(dead_code, clippy::unwrap_used, clippy::print_stdout, missing_docs)]

use std::path::PathBuf;

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion};
use point_cloud::NeighbourTree;

/// A file or folder of the captures; says so where it is missing.
pub fn real(path: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real")).join(path);
    if folder.exists() {
        return Some(folder);
    }
    println!("skipped: {path} is not there");
    None
}

/// Lines of three or more numbers; all others are left out.
pub fn points(path: &PathBuf) -> Vec<Point3<f64>> {
    std::fs::read_to_string(path)
        .unwrap()
        .lines()
        .filter_map(|line| {
            let v: Vec<f64> = line.split([',', ';', ' ', '\t']).filter_map(|w| w.trim().parse().ok()).collect();
            (v.len() >= 3).then(|| Point3::new(v[0], v[1], v[2]))
        })
        .collect()
}

/// A pose from the rows of its matrix.
pub fn pose_of_rows(v: &[f64]) -> Isometry3<f64> {
    let matrix = Matrix3::new(v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Isometry3::from_parts(Translation3::new(v[3], v[7], v[11]), rotation)
}

/// Median distance of the moved points from their nearest ones.
pub fn median_distance(source: &[Point3<f64>], tree: &NeighbourTree, pose: &Isometry3<f64>) -> f64 {
    let mut distances: Vec<f64> = source.iter().map(|p| tree.nearest(&(pose * p)).unwrap().distance_m).collect();
    distances.sort_by(f64::total_cmp);
    distances[distances.len() / 2]
}
