//! Measured points brought onto a known model.
#![cfg(feature = "mesh")]

use crate::common;
use crate::common::{Pinhole, Scene as Room, cloud, disturbance, look_at, pose_error};
use icp_registration::parts::{ClosestOnMesh, PointToPoint, TriangleMesh};
use icp_registration::{Error, MotionKind, Registration};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use rigid_pose::InputError;
use rigid_pose::pose_difference;

fn room_mesh() -> TriangleMesh {
    let (vertices, triangles) = common::scenes::triangles(&Room::furnished());
    TriangleMesh::new(&vertices, &triangles).unwrap()
}

#[test]
fn a_frame_finds_its_place_in_the_model() {
    let mesh = room_mesh();
    let registration = Registration::new(ClosestOnMesh::new(&mesh));
    let (room, camera) = (Room::furnished(), Pinhole { width: 88, height: 72, focal_px: 76.0 });
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..5 {
        let camera_pose = look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]) * disturbance(0.3, 10.0, 50 + seed);
        let source = cloud(&room, &camera, &camera_pose, 1.0, seed);
        let guess = disturbance(0.1, 5.0, 70 + seed) * camera_pose;
        let result = registration.align(&source, &guess).unwrap();
        let (mm, degrees) = pose_error(&result.target_from_source, &camera_pose);
        let error = pose_difference(&result.target_from_source, &camera_pose);
        let square = error.dot(&(result.covariance.try_inverse().unwrap() * error));
        println!("{seed}: {mm:.3} mm {degrees:.4} deg {:?} {:?}; squared {square:.1}", result.stop, result.degenerate);
        // 6000 points of 2 to 9 mm that share nothing.
        assert!(mm < 1.0 && degrees < 0.03);
        assert!(result.is_trustworthy());
        (sum, count) = (sum + square, count + 1.0);
    }
    // Six expected; the mean of 5 scatters by 6 * sqrt(2 / 6 / 5) = 1.5.
    assert!((1.5..13.0).contains(&(sum / count)), "{}", sum / count);
}

#[test]
fn points_to_points_of_the_surface_work_as_well() {
    let mesh = room_mesh();
    let mut registration = Registration::new(ClosestOnMesh::new(&mesh));
    registration.metric = Box::new(PointToPoint);
    let (room, camera) = (Room::furnished(), Pinhole { width: 88, height: 72, focal_px: 76.0 });
    let pose = look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]);
    let source = cloud(&room, &camera, &pose, 1.0, 3);
    let result = registration.align(&source, &(disturbance(0.05, 2.0, 3) * pose)).unwrap();
    let (mm, degrees) = pose_error(&result.target_from_source, &pose);
    println!("point to point: {mm:.3} mm {degrees:.4} deg, {} iterations {:?}", result.iterations, result.stop);
    // The closest point of a continuous surface lies along its normal: as point to plane, but it creeps.
    assert!(mm < 3.0 && degrees < 0.1);
}

#[test]
fn a_plate_leaves_three_motions_open_without_normals_of_the_points() {
    let vertices = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Point3::new(x, y, 0.0));
    let mesh = TriangleMesh::new(&vertices, &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let at = |i: i32, n: i32| 1.6 * (f64::from(i) / f64::from(n) - 0.5);
    let points = (0..900).map(|k| Point3::new(at(k % 30, 30), at(k / 30, 30), 0.0)).collect();
    let mut cloud = Cloud::new(points);
    cloud.normals = Some(vec![Vector3::repeat(f64::NAN); 900]);
    let guess = Isometry3::new(Vector3::new(0.01, 0.0, 0.02), Vector3::new(0.01, 0.0, 0.01));
    let result = Registration::new(ClosestOnMesh::new(&mesh)).align(&cloud, &guess).unwrap();
    assert_eq!(result.degenerate.len(), 3, "{:?}", result.degenerate);
    assert_eq!(result.degenerate.iter().filter(|m| m.kind == MotionKind::Translation).count(), 2);
    assert!(result.target_from_source.translation.z.abs() < 1e-9);
}

#[test]
fn meshes_that_are_none_are_refused() {
    let corners =
        [Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(2.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    assert!(matches!(TriangleMesh::new(&corners, &[]), Err(Error::Input(InputError::Empty { .. }))));
    assert!(matches!(TriangleMesh::new(&corners, &[[0, 1, 2]]), Err(Error::Input(InputError::Empty { .. }))));
    assert!(matches!(TriangleMesh::new(&corners, &[[0, 1, 4]]), Err(Error::NoSuchVertex { vertex: 4, count: 4 })));
    let nan = [Point3::origin(), Point3::new(f64::NAN, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0)];
    assert!(matches!(TriangleMesh::new(&nan, &[[0, 1, 2]]), Err(Error::Input(InputError::NonFinite { index: 1, .. }))));
    let mesh = TriangleMesh::new(&corners, &[[0, 1, 2], [0, 1, 3]]).unwrap();
    assert_eq!((mesh.len(), mesh.is_empty()), (1, false));
    let (point, normal) = mesh.closest(&Point3::new(0.2, 0.3, 0.5), 1.0).unwrap().unwrap();
    assert!((point - Point3::new(0.2, 0.3, 0.0)).norm() < 1e-15 && (normal - Vector3::z()).norm() < 1e-15);
    assert!(mesh.closest(&Point3::new(0.2, 0.3, 0.5), 0.4).unwrap().is_none());
    assert!(matches!(
        mesh.closest(&Point3::new(f64::NAN, 0.0, 0.0), 1.0),
        Err(Error::Input(InputError::NonFinite { .. }))
    ));
}
