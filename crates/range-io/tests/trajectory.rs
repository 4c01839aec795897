//! Trajectories and the turn between photogrammetric and computer-vision axes.
#![cfg(feature = "trajectory")]

use crate::common;
use camera_model::pose_from_euler;
use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;
use range_io::trajectory::{
    StampedPose, TrajectoryFormat, read_any_trajectory, read_kitti, read_tum, write_any_trajectory, write_euroc,
    write_kitti, write_tum,
};

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

#[test]
fn every_written_form_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let poses =
        [pose(1.25e9 + 0.25, [1.0, -2.0, 3.0], [0.3, -1.0, 2.0]), pose(1.25e9 + 0.5, [0.0; 3], [0.0, 0.1, 3.0])];
    for format in [TrajectoryFormat::Tum, TrajectoryFormat::Kitti, TrajectoryFormat::Euroc] {
        let file = folder.path().join("poses");
        write_any_trajectory(&file, &poses, format).unwrap();
        assert_eq!(TrajectoryFormat::of_file(&file).unwrap(), format);
        let back = read_any_trajectory(&file).unwrap();
        assert_eq!(back.len(), 2);
        for (index, (found, expected)) in back.iter().zip(&poses).enumerate() {
            let time = if format == TrajectoryFormat::Kitti { index as f64 } else { expected.timestamp_s };
            assert!((found.timestamp_s - time).abs() < 1e-9, "{format:?}: the times are multiples of 1/4 s");
            let difference = found.world_from_camera.to_homogeneous() - expected.world_from_camera.to_homogeneous();
            assert!(difference.amax() < 1e-14, "{format:?}: rounding of a matrix");
        }
    }
    let times = folder.path().join("times.txt");
    write_kitti(folder.path().join("poses"), &poses).unwrap();
    std::fs::write(&times, "0.5\n0.75\n").unwrap();
    let back = read_any_trajectory(folder.path().join("poses")).unwrap();
    assert_eq!(back.iter().map(|pose| pose.timestamp_s).collect::<Vec<_>>(), [0.5, 0.75]);
    std::fs::write(&times, "0.5\n").unwrap();
    let message = read_kitti(folder.path().join("poses"), Some(&times)).unwrap_err().to_string();
    assert!(message.contains("times.txt: has 1 times, expected 2"), "{message}");
}

#[test]
fn logs_and_folders_of_matrices_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let matrix = "1 0 0 4\n0 -1 0 5\n0 0 -1 6\n0 0 0 1\n";
    let log = folder.path().join("t.log");
    std::fs::write(&log, format!("3 3 4\n{matrix}7\t7\t8\n{matrix}")).unwrap();
    let poses = read_any_trajectory(&log).unwrap();
    assert_eq!(poses.len(), 2);
    assert_eq!(poses[1], StampedPose { timestamp_s: 7.0, world_from_camera: Isometry3::translation(4.0, 5.0, 6.0) });
    for (from, to, expected) in [
        ("0 0 0 1", "0 0 1 1", "t.log:5:1: is the fourth row of a pose"),
        ("1 0 0 4", "1.1 0 0 4", "t.log:2:1: `R`: is no rotation"),
        ("0 0 -1 6", "0 0 1 6", "t.log:2:1: `R`: is a reflection"),
        ("0 -1 0 5", "0 -1 0", "t.log:3:4: `column 4`: is missing"),
        ("0 0 -1 6\n0 0 0 1\n", "", "is the last line, 2 of 4 rows"),
    ] {
        std::fs::write(&log, format!("3 3 4\n{matrix}").replace(from, to)).unwrap();
        let message = read_any_trajectory(&log).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}\nexpected: {expected}");
    }
    let scenes = folder.path().join("seq");
    std::fs::create_dir(&scenes).unwrap();
    assert!(read_any_trajectory(&scenes).unwrap_err().to_string().contains("has no poses"));
    for frame in [10, 5] {
        std::fs::write(scenes.join(format!("frame-{frame:06}.pose.txt")), matrix).unwrap();
    }
    let poses = read_any_trajectory(&scenes).unwrap();
    assert_eq!(poses.iter().map(|pose| pose.timestamp_s).collect::<Vec<_>>(), [5.0, 10.0]);
}

#[test]
fn real_trajectories_are_read() {
    for (path, poses) in [("redwood_rgbd5/trajectory.log", 5), ("redwood_rgbd5/odometry.log", 5)] {
        let Some(path) = common::real(path) else { continue };
        assert_eq!(read_any_trajectory(path).unwrap().len(), poses);
    }
    let Some(path) = common::real("sevenscenes_redkitchen") else { return };
    let poses = read_any_trajectory(path).unwrap();
    let frame = |time: f64| poses.iter().find(|pose| (pose.timestamp_s - time).abs() < 0.5).unwrap().world_from_camera;
    let way = (frame(50.0).translation.vector - frame(0.0).translation.vector).norm();
    assert!((way - 0.167).abs() < 5e-4, "the capture's own description: frame 50 is 167 mm away");
}
