//! Real scans, read where they lie; skipped with a word where they are missing.

use std::path::PathBuf;

use crate::scans::{median_distance, points, pose_of_rows, real};
use icp_registration::{IcpOptions, IcpTarget};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use point_cloud::{Cloud, NeighbourTree, OrganisedNormalOptions, organised_normals};

#[test]
fn bunny_scans_come_together() {
    let (Some(a), Some(b)) = (real("stanford_bunny_2scans/bun000.xyz"), real("stanford_bunny_2scans/bun045.xyz"))
    else {
        return;
    };
    let (target, source) = (points(&a), points(&b));
    let tree = NeighbourTree::new(&target).unwrap();
    // bun.conf: p000 = R(q)^T p045 + t.
    let q = nalgebra::Quaternion::new(0.955_586, 0.005_484_49, -0.294_635, -0.003_855_5);
    let reference = Isometry3::from_parts(
        Translation3::new(-0.052_021_1, -0.000_383_981, -0.010_922_3),
        UnitQuaternion::from_quaternion(q).inverse(),
    );
    let prepared = IcpTarget::new(Cloud::new(target)).unwrap();
    let source_cloud = Cloud::new(source.clone());
    let off = Isometry3::rotation(Vector3::new(0.3, 1.0, -0.2).normalize() * 30.0_f64.to_radians()) * reference;
    for (name, guess) in [("identity", Isometry3::identity()), ("30 degrees off", off)] {
        let result = prepared.align(&source_cloud, &guess, &IcpOptions::default()).unwrap();
        let median = median_distance(&source, &tree, &result.target_from_source) * 1e3;
        println!("{name}: median {median:.3} mm, {} iterations, {:?}", result.iterations, result.stop);
        println!(
            "  reference {:.3}; overlap {:.2} {:?}",
            median_distance(&source, &tree, &reference) * 1e3,
            result.overlap,
            result.degenerate
        );
        // The grid is 0.5 mm; the reference pose itself leaves 0.33 mm.
        assert!(median <= 0.35, "{name}: {median} mm");
        assert!(result.is_trustworthy());
    }
}

#[test]
fn tilting_laser_scans_agree_with_the_reference() {
    let (Some(a), Some(b), Some(reference)) = (
        real("libpointmatcher_icp/cloud.00000.vtk"),
        real("libpointmatcher_icp/cloud.00001.vtk"),
        real("libpointmatcher_icp/icp_data/defaultIdentityDataPointsFilter.ref_trans"),
    ) else {
        return;
    };
    let numbers: Vec<f64> =
        std::fs::read_to_string(reference).unwrap().split_whitespace().map(|w| w.parse().unwrap()).collect();
    let reference = pose_of_rows(&numbers);
    check("cloud.00001", &points(&a), &points(&b), &reference);
}

#[test]
fn car_scans_agree_with_the_reference() {
    let (Some(a), Some(b)) =
        (real("libpointmatcher_icp/car_cloud400.csv"), real("libpointmatcher_icp/car_cloud401.csv"))
    else {
        return;
    };
    #[rustfmt::skip]
    let reference = pose_of_rows(&[
        0.981_715, 0.169_605, -0.086_423_9, 0.061_412_7, -0.152_902, 0.973_034, 0.172_703, 0.191_433,
        0.113_385, -0.156_33, 0.981_175, -0.033_857_1,
    ]);
    check("car 401", &points(&a), &points(&b), &reference);
}

fn check(name: &str, target: &[Point3<f64>], source: &[Point3<f64>], reference: &Isometry3<f64>) {
    let tree = NeighbourTree::new(target).unwrap();
    let prepared = IcpTarget::new(Cloud::new(target.to_vec())).unwrap();
    let result = prepared.align(&Cloud::new(source.to_vec()), &Isometry3::identity(), &IcpOptions::default()).unwrap();
    let found = result.target_from_source;
    let metres = (found.translation.vector - reference.translation.vector).norm();
    let degrees = found.rotation.angle_to(&reference.rotation).to_degrees();
    let medians = [&found, reference].map(|pose| median_distance(source, &tree, pose));
    println!(
        "{name}: {} and {} points, {metres:.3} m {degrees:.2} deg from the reference, medians {medians:?}, {:?} {:?} lim {}",
        target.len(),
        source.len(),
        result.stop,
        result.degenerate,
        result.max_correspondence_distance_m
    );
    let sigma: Vec<f64> = (0..6).map(|k| result.covariance[(k, k)].sqrt()).collect();
    println!("  sigma {sigma:.4?}");
    // The references of the library's own tests differ among each other by 4 cm and 0.6 degrees.
    assert!(metres < 0.08 && degrees < 1.0, "{name}: {metres} m {degrees} degrees");
    assert!(medians[0] < 1.05 * medians[1]);
}

/// A depth frame of a structured-light camera in its own frame (x right, y down, z forward), every fourth pixel.
fn depth_frame(path: &PathBuf) -> Cloud {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let (width, height) = (info.width as usize, info.height as usize);
    let point = |k: usize| {
        let (col, row) = (4 * (k % (width / 4)), 4 * (k / (width / 4)));
        let at = 2 * (row * width + col);
        let z = f64::from(u16::from_be_bytes([bytes[at], bytes[at + 1]])) * 1e-3;
        if z <= 0.0 || z > 4.0 {
            return [f64::NAN; 3];
        }
        [(col as f64 - 319.5) * z / 525.0, (row as f64 - 239.5) * z / 525.0, z]
    };
    let (width, height) = (width / 4, height / 4);
    let points: Vec<[f64; 3]> = (0..width * height).map(point).collect();
    let normals = organised_normals(&points, width, height, &OrganisedNormalOptions::default()).unwrap();
    Cloud::from_frame(&points, Some(&normals), None).unwrap()
}

#[test]
fn indoor_frames_follow_their_trajectory() {
    let Some(folder) = real("redwood_rgbd5") else { return };
    let log = std::fs::read_to_string(folder.join("trajectory.log")).unwrap();
    let lines: Vec<Vec<f64>> =
        log.lines().map(|line| line.split_whitespace().map(|w| w.parse().unwrap()).collect()).collect();
    let poses: Vec<Isometry3<f64>> = lines.chunks(5).map(|block| pose_of_rows(&block[1..4].concat())).collect();
    let frames: Vec<Cloud> = (0..5).map(|k| depth_frame(&folder.join(format!("depth/{k:05}.png")))).collect();
    let targets: Vec<IcpTarget> = frames.iter().map(|frame| IcpTarget::new(frame.clone()).unwrap()).collect();
    for (target, source) in [(0, 1), (1, 2), (2, 3), (3, 4), (0, 4)] {
        let result = targets[target].align(&frames[source], &Isometry3::identity(), &IcpOptions::default()).unwrap();
        let reference = poses[target].inverse() * poses[source];
        let metres = (result.target_from_source.translation.vector - reference.translation.vector).norm();
        let degrees = result.target_from_source.rotation.angle_to(&reference.rotation).to_degrees();
        let moved = reference.translation.vector.norm();
        println!("{target}-{source}: {metres:.4} m {degrees:.3} deg off, moved {moved:.3} m, {:?}", result.stop);
        // The depth is quantised by 1 to 3 mm and warped by centimetres at the rim; the trajectory is good to 8 mm.
        assert!(metres < 0.02 && degrees < 0.6, "{target}-{source}: {metres} m {degrees} degrees");
    }
}
