//! Real scans aligned without a guess; skipped with a word where they are missing.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, missing_docs)]

use std::path::PathBuf;

use icp_registration::{Cloud, CoarseOptions, FeatureCloud, Viewpoint, align_without_guess};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};

fn points(path: &str) -> Option<Vec<Point3<f64>>> {
    let file = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real")).join(path);
    let Ok(text) = std::fs::read_to_string(file) else {
        println!("skipped: {path} is not there");
        return None;
    };
    let lines = text.lines().filter_map(|line| {
        let v: Vec<f64> = line.split([',', ';', ' ', '\t']).filter_map(|w| w.trim().parse().ok()).collect();
        (v.len() >= 3).then(|| Point3::new(v[0], v[1], v[2]))
    });
    Some(lines.collect())
}

#[test]
fn bunny_scans_45_degrees_apart_come_together() {
    let (Some(target), Some(source)) =
        (points("stanford_bunny_2scans/bun000.xyz"), points("stanford_bunny_2scans/bun045.xyz"))
    else {
        return;
    };
    // bun.conf: p000 = R(q)^T p045 + t.
    let q = Quaternion::new(0.955_586, 0.005_484_49, -0.294_635, -0.003_855_5);
    let reference = Isometry3::from_parts(
        Translation3::new(-0.052_021_1, -0.000_383_981, -0.010_922_3),
        UnitQuaternion::from_quaternion(q).inverse(),
    );
    // The scanner looked along -z of each scan's frame.
    let options = CoarseOptions { viewpoint: Viewpoint::At(Point3::new(0.0, 0.1, 1.0)), ..CoarseOptions::default() };
    let prepared = |points: Vec<Point3<f64>>| FeatureCloud::new(&Cloud::new(points), &options).unwrap();
    let found = align_without_guess(&prepared(source), &prepared(target), &options).unwrap();
    let middle = Point3::new(-0.02, 0.1, 0.02);
    let apart = (found.target_from_source * middle - reference * middle).norm();
    let degrees = found.target_from_source.rotation.angle_to(&reference.rotation).to_degrees();
    println!("bunny: {:.2} mm {degrees:.2} deg {found:?}", apart * 1e3);
    // A voxel is some 2 mm.
    assert!(apart < 0.004 && degrees < 3.0, "{apart} m {degrees} deg");
}
