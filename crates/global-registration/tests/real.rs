//! Real scans aligned without a guess; skipped with a word where they are missing.

use std::path::PathBuf;

use crate::common::pose_error;
use crate::depth_frames::{Sequence, kitchen, living_room};

use global_registration::{CoarseOptions, FeatureCloud, Viewpoint, align_without_guess};
use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion};
use point_cloud::Cloud;

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

/// Frames `apart` from each other in a sequence: right answers, of those asked for; wrong ones fail.
fn found_pairs(sequence: &Sequence, apart: usize) -> (usize, usize) {
    let options = CoarseOptions::default();
    let prepared = |k: usize| {
        FeatureCloud::new(&Cloud::from_frame(&sequence.frames[k].points, None, None).unwrap(), &options).unwrap()
    };
    let (mut right, mut asked) = (0, 0);
    for k in (0..sequence.frames.len() - apart).step_by(apart) {
        asked += 1;
        let truth = sequence.frames[k].world_from_camera.inverse() * sequence.frames[k + apart].world_from_camera;
        match align_without_guess(&prepared(k + apart), &prepared(k), &options) {
            Ok(found) => {
                let (mm, degrees) = pose_error(&found.target_from_source, &truth);
                println!("{k}: {mm:.1} mm {degrees:.2} deg {found:?}");
                assert!(mm < 100.0 && degrees < 5.0, "pair {k}: {mm} mm, {degrees} degrees");
                right += 1;
            }
            Err(error) => println!("{k}: {error}"),
        }
    }
    (right, asked)
}

#[test]
fn frames_of_a_kitchen_are_found() {
    let Some(sequence) = kitchen(20) else {
        println!("skipped: the kitchen is not there");
        return;
    };
    let (right, asked) = found_pairs(&sequence, 3);
    println!("kitchen: {right} of {asked}");
    // A refusal is no error, but that of most pairs with this much in common would be.
    assert!(2 * right > asked, "{right} of {asked}");
}

#[test]
fn frames_of_a_living_room_are_found() {
    let Some(sequence) = living_room() else {
        println!("skipped: the living room is not there");
        return;
    };
    let (right, asked) = found_pairs(&sequence, 1);
    println!("living room: {right} of {asked}");
    assert!(2 * right > asked, "{right} of {asked}");
}

fn pose_of_rows(v: &[f64]) -> Isometry3<f64> {
    let matrix = Matrix3::new(v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Isometry3::from_parts(Translation3::new(v[3], v[7], v[11]), rotation)
}

/// Laser scans of a few thousand points far apart: right, or refused.
fn check_laser(target: &str, source: &str, reference: &Isometry3<f64>) {
    let (Some(target_points), Some(source_points)) = (points(target), points(source)) else { return };
    for options in
        [CoarseOptions::default(), CoarseOptions { viewpoint: Viewpoint::Unknown, ..CoarseOptions::default() }]
    {
        let prepared = |points: &[Point3<f64>]| FeatureCloud::new(&Cloud::new(points.to_vec()), &options).unwrap();
        match align_without_guess(&prepared(&source_points), &prepared(&target_points), &options) {
            Ok(found) => {
                let (mm, degrees) = pose_error(&found.target_from_source, reference);
                println!("{source}: {mm:.0} mm {degrees:.2} deg {found:?}");
                // References are good to their own 9 cm between points; voxels are several times that.
                assert!(mm < 500.0 && degrees < 5.0, "{source}: {mm} mm, {degrees} degrees");
            }
            Err(error) => println!("{source}: {error}"),
        }
    }
}

#[test]
fn laser_scans_are_found_or_refused() {
    let file = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real"))
        .join("libpointmatcher_icp/icp_data/defaultIdentityDataPointsFilter.ref_trans");
    if let Ok(text) = std::fs::read_to_string(file) {
        let numbers: Vec<f64> = text.split_whitespace().map(|w| w.parse().unwrap()).collect();
        let [a, b] = ["libpointmatcher_icp/cloud.00000.vtk", "libpointmatcher_icp/cloud.00001.vtk"];
        check_laser(a, b, &pose_of_rows(&numbers));
    }
    #[rustfmt::skip]
    let car = pose_of_rows(&[
        0.981_715, 0.169_605, -0.086_423_9, 0.061_412_7, -0.152_902, 0.973_034, 0.172_703, 0.191_433,
        0.113_385, -0.156_33, 0.981_175, -0.033_857_1,
    ]);
    check_laser("libpointmatcher_icp/car_cloud400.csv", "libpointmatcher_icp/car_cloud401.csv", &car);
}
