//! Trajectories and the turn between photogrammetric and computer-vision axes.
#![cfg(feature = "trajectory")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use camera_model::pose_from_euler;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use range_io::trajectory::{StampedPose, read_tum, write_euroc, write_kitti, write_tum};

mod common;

fn pose(timestamp_s: f64, position: [f64; 3], angles: [f64; 3]) -> StampedPose {
    StampedPose { timestamp_s, world_from_camera: pose_from_euler(Vector3::from(position), angles) }
}

proptest! {
    #![proptest_config(common::cases(48))]

    #[test]
    fn poses_come_back(
        time in -1e9..2e9_f64, position in prop::array::uniform3(-1e3..1e3_f64), angles in prop::array::uniform3(-3.2..3.2_f64),
    ) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("trajectory.txt");
        let poses = [pose(time, position, angles), pose(time + 1.0, [0.0; 3], [0.0; 3])];
        write_tum(&file, &poses).unwrap();
        let back = read_tum(&file).unwrap();
        prop_assert_eq!(back.len(), 2);
        for (found, expected) in back.iter().zip(&poses) {
            prop_assert_eq!(found.timestamp_s.to_bits(), expected.timestamp_s.to_bits());
            prop_assert_eq!(found.world_from_camera.translation, expected.world_from_camera.translation);
            // Two turns by a quaternion: its rounding. The angle between is computed from a cosine near 1.
            prop_assert!(found.world_from_camera.rotation.angle_to(&expected.world_from_camera.rotation) < 1e-7);
        }
    }
}

#[test]
fn files_have_computer_vision_axes() {
    let folder = tempfile::tempdir().unwrap();
    // A camera with the axes of the world looks along -z with y up; in computer-vision axes it is turned about x.
    let poses = [pose(0.5, [1.0, 2.0, 3.0], [0.0; 3])];
    let file = folder.path().join("t.txt");
    write_tum(&file, &poses).unwrap();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "0.5 1 2 3 1 0 0 0\n");
    write_kitti(&file, &poses).unwrap();
    let numbers: Vec<f64> =
        std::fs::read_to_string(&file).unwrap().split_whitespace().map(|word| word.parse().unwrap()).collect();
    let expected = [1.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 2.0, 0.0, 0.0, -1.0, 3.0];
    assert_eq!(numbers.len(), 12);
    assert!(numbers.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{numbers:?}");
    write_euroc(&file, &poses).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    assert_eq!(text.lines().nth(1).unwrap(), "500000000,1,2,3,0,1,0,0");
    assert!(text.starts_with("#timestamp [ns],p_RS_R_x [m]"));
}

#[test]
fn comments_and_short_quaternions_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("t.txt");
    std::fs::write(&file, "# timestamp tx ty tz qx qy qz qw\n\n1 0 0 0  0.707 0 0 0.707\n").unwrap();
    let poses = read_tum(&file).unwrap();
    assert!((poses[0].world_from_camera.rotation.norm() - 1.0).abs() < 1e-15);
}

#[test]
fn faults_name_line_and_field() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("t.txt");
    let fault = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let message = read_tum(&file).unwrap_err().to_string();
        message.rsplit_once('/').unwrap().1.to_owned()
    };
    assert_eq!(fault("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 1\n"), "t.txt:2:8: `qw`: is missing");
    assert_eq!(fault("0 0 x 0 0 0 0 1\n"), "t.txt:1:3: `ty`: is `x`, expected a finite number");
    assert_eq!(fault("nan 0 0 0 0 0 0 1\n"), "t.txt:1:1: `timestamp`: is `nan`, expected a finite number");
    assert_eq!(fault("0 0 0 0 0 0 0 2\n"), "t.txt:1:5: `qx qy qz qw`: has length 2, expected 1");
    assert_eq!(fault("0 0 0 0 0 0 0 1 5\n"), "t.txt:1:9: `5` is one field too many, expected 8");
    let lost = StampedPose { timestamp_s: f64::NAN, world_from_camera: Isometry3::identity() };
    assert!(write_tum(&file, &[lost]).unwrap_err().to_string().contains("is not finite"));
}
