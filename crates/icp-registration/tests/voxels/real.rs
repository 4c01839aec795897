//! Real scans, read where they lie; skipped with a word where they are missing.

use icp_registration::{VoxelAlignmentOptions, VoxelCloud};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use point_cloud::{Cloud, NeighbourTree};

use crate::scans::{median_distance, points, pose_of_rows, real};

fn prepared(points: &[Point3<f64>]) -> VoxelCloud {
    VoxelCloud::new(&Cloud::new(points.to_vec()), None).unwrap()
}

#[test]
fn bunny_scans_come_together() {
    let (Some(a), Some(b)) = (real("stanford_bunny_2scans/bun000.xyz"), real("stanford_bunny_2scans/bun045.xyz"))
    else {
        return;
    };
    let (target, source) = (points(&a), points(&b));
    let tree = NeighbourTree::new(&target).unwrap();
    // bun.conf: p000 = R(q)^T p045 + t.
    let q = Quaternion::new(0.955_586, 0.005_484_49, -0.294_635, -0.003_855_5);
    let reference = Isometry3::from_parts(
        Translation3::new(-0.052_021_1, -0.000_383_981, -0.010_922_3),
        UnitQuaternion::from_quaternion(q).inverse(),
    );
    let (voxels, moving) = (prepared(&target), prepared(&source));
    let off = Isometry3::rotation(Vector3::new(0.3, 1.0, -0.2).normalize() * 30.0_f64.to_radians()) * reference;
    for (name, guess) in [("identity", Isometry3::identity()), ("30 degrees off", off)] {
        let result = voxels.align(&moving, &guess, &VoxelAlignmentOptions::default()).unwrap();
        let median = median_distance(&source, &tree, &result.target_from_source) * 1e3;
        let at_reference = median_distance(&source, &tree, &reference) * 1e3;
        println!(
            "{name}: median {median:.3} mm, reference {at_reference:.3}, {} iterations, {:?}, overlap {:.2}, {:?}",
            result.iterations, result.stop, result.overlap, result.degenerate
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
    let text = std::fs::read_to_string(reference).unwrap();
    let numbers: Vec<f64> = text.split_whitespace().map(|word| word.parse().unwrap()).collect();
    check("cloud.00001", &points(&a), &points(&b), &pose_of_rows(&numbers));
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
    let options = VoxelAlignmentOptions::default();
    let result = prepared(target).align(&prepared(source), &Isometry3::identity(), &options).unwrap();
    let found = result.target_from_source;
    let metres = (found.translation.vector - reference.translation.vector).norm();
    let degrees = found.rotation.angle_to(&reference.rotation).to_degrees();
    let medians = [&found, reference].map(|pose| median_distance(source, &tree, pose));
    println!(
        "{name}: {metres:.3} m {degrees:.2} deg from the reference, medians {medians:?}, {} iterations, {:?}, {:?}, voxels {:.3}",
        result.iterations,
        result.stop,
        result.degenerate,
        result.max_correspondence_distance_m / 1.5
    );
    // The references of the library's own tests differ among each other by 4 cm and 0.6 degrees.
    assert!(metres < 0.08 && degrees < 1.0, "{name}: {metres} m {degrees} degrees");
    // The references bring nearest points together; planes through voxels of half a metre need not do so as well.
    assert!(medians[0] < 1.2 * medians[1]);
}
