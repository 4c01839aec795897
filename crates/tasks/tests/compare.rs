//! Two results held against each other.

use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use pipeline::Silent;
use range_io::clouds::{CloudFile, Precision, write_any_cloud};
use range_io::tables::{Station, write_stations};
use range_io::trajectory::{StampedPose, TrajectoryFormat, write_any_trajectory};
use tasks::{CompareAlignment, CompareRequest, Comparison, compare};

/// Three walls of a corner, 2 m long, one point every 2 cm, a wave of 10 cm on each so that a motion is determined.
fn corner() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for (i, j) in (0..100).flat_map(|i| (0..100).map(move |j| (i, j))) {
        let (u, v) = (0.02 * f64::from(i) + 0.01, 0.02 * f64::from(j) + 0.01);
        let wave = 0.1 * (3.0 * u).sin() * (2.0 * v).cos();
        points.extend([[u - 1.0, v - 1.0, wave - 3.0], [u - 1.0, wave - 1.2, v - 3.0], [wave - 1.2, u - 1.0, v - 3.0]]);
    }
    points
}

fn cloud(points: Vec<[f64; 3]>) -> CloudFile {
    CloudFile { points, ..CloudFile::default() }
}

fn moved(points: &[[f64; 3]], motion: &Isometry3<f64>) -> Vec<[f64; 3]> {
    points.iter().map(|point| (motion * Point3::from(*point)).coords.into()).collect()
}

fn run(request: &CompareRequest) -> Comparison {
    compare(request, &Silent).unwrap()
}

fn fault(first: &Path, second: &Path) -> String {
    compare(&CompareRequest::new(first, second), &Silent).unwrap_err().to_string()
}

#[test]
fn a_shift_shows_with_its_sign_in_any_format() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    // The back wall alone, seen from the origin, and moved 5 mm towards it.
    let wall: Vec<_> = corner().into_iter().step_by(3).collect();
    let nearer: Vec<_> = wall.iter().map(|[x, y, z]| [*x, *y, z + 0.005]).collect();
    let mut ours = cloud(nearer);
    ours.flags = Some((0..ours.len()).map(|index| u16::from(index < 7)).collect());
    write_any_cloud(file("a.pcd"), &ours, Precision::Double).unwrap();
    write_any_cloud(file("b.e57"), &cloud(wall), Precision::Double).unwrap();
    let request = CompareRequest { out: Some(file("out")), ..CompareRequest::new(file("a.pcd"), file("b.e57")) };
    let comparison = run(&request);
    let clouds = comparison.clouds.as_ref().unwrap();
    assert_eq!((clouds.points, clouds.left_out, clouds.reference_points), (9993, 7, 10_000));
    let plane = clouds.plane.as_ref().unwrap();
    // The slope of the wave is at most 0.3: distances across it are 5 mm times its cosine, at least 4.7 mm. Planes through
    // neighbours 3 cm apart cut the wave's curvature of 0.9 / m by some tenths of a millimetre.
    assert!((0.0045..0.0051).contains(&plane.median_m), "{plane:?}");
    assert!(plane.mean_m > 0.0 && plane.positive.contains("origin"));
    let histogram = &plane.histogram;
    assert_eq!(histogram.counts.iter().sum::<usize>() + histogram.below + histogram.above, plane.points);
    // No point is farther than the shift from its own partner.
    assert!(clouds.distance_max_m < 0.005 + 1e-9);
    let page = std::fs::read_to_string(file("out/report.html")).unwrap();
    assert!(page.contains("Signed distance to the local plane, seen along") && page.contains("data:image/png"));
    assert!(!page.contains("NaN"));
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(file("out/comparison.json")).unwrap()).unwrap();
    assert_eq!(json["clouds"]["points"], 9993);
    assert!(comparison.to_string().contains("9993 points against 10000 (7 more are flagged"));
}

#[test]
fn clouds_are_registered_first_where_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let motion = Isometry3::new(Vector3::new(0.03, -0.02, 0.01), Vector3::new(0.0, 0.02, -0.01));
    write_any_cloud(file("a.ply"), &cloud(moved(&corner(), &motion)), Precision::Double).unwrap();
    write_any_cloud(file("b.ply"), &cloud(corner()), Precision::Double).unwrap();
    let plain = run(&CompareRequest::new(file("a.ply"), file("b.ply")));
    assert!(plain.clouds.unwrap().plane.unwrap().rms_m > 0.005);
    let request =
        CompareRequest { alignment: CompareAlignment::Rigid, ..CompareRequest::new(file("a.ply"), file("b.ply")) };
    let clouds = run(&request).clouds.unwrap();
    let alignment = clouds.alignment.unwrap();
    let back = motion.inverse();
    let off = Vector3::from(alignment.translation_m) - back.translation.vector;
    // Sampled surfaces against each other: a fraction of the spacing of 2 cm.
    assert!(off.norm() < 1e-3 && alignment.doubts.is_empty(), "{alignment:?}");
    assert!(clouds.plane.unwrap().rms_m < 1e-3);
}

#[test]
fn far_points_are_counted_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut ours = corner();
    ours.extend([[50.0, 0.0, 0.0], [60.0, 0.0, f64::NAN]]);
    write_any_cloud(file("a.ply"), &cloud(ours), Precision::Double).unwrap();
    write_any_cloud(file("b.ply"), &cloud(corner()), Precision::Double).unwrap();
    let request = CompareRequest { max_distance_m: Some(1.0), ..CompareRequest::new(file("a.ply"), file("b.ply")) };
    let clouds = run(&request).clouds.unwrap();
    assert_eq!((clouds.points, clouds.beyond, clouds.left_out), (30_000, 1, 1));
    assert!(clouds.distance_max_m < 1e-12, "the rest is the same cloud");
}

fn track() -> Vec<StampedPose> {
    let pose = |i: i32| {
        let s = 0.1 * f64::from(i);
        let position = Vector3::new(s.cos(), s.sin(), 0.3 * (2.0 * s).sin());
        let attitude = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.2 * s, 0.1));
        StampedPose { timestamp_s: s, world_from_camera: Isometry3::from_parts(position.into(), attitude) }
    };
    (0..80).map(pose).collect()
}

#[test]
fn trajectories_of_two_forms_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let motion = Isometry3::new(Vector3::new(3.0, 1.0, -2.0), Vector3::new(0.1, -0.7, 0.4));
    let mut ours = track();
    for pose in &mut ours {
        pose.world_from_camera = motion * pose.world_from_camera;
    }
    ours[40].world_from_camera.translation.vector.x += 0.5;
    write_any_trajectory(file("ours.txt"), &ours, TrajectoryFormat::Tum).unwrap();
    write_any_trajectory(file("truth.csv"), &track(), TrajectoryFormat::Euroc).unwrap();
    let request = CompareRequest {
        alignment: CompareAlignment::Similarity,
        out: Some(file("out")),
        ..CompareRequest::new(file("ours.txt"), file("truth.csv"))
    };
    let trajectory = run(&request).trajectory.unwrap();
    assert_eq!(trajectory.matched, 80);
    let names: Vec<_> = trajectory.absolute.iter().map(|row| row.alignment).collect();
    assert_eq!(names, ["as they stand", "rigid", "with scale"]);
    assert!(trajectory.absolute[0].position_m.rms > 1.0);
    // One pose of eighty is half a metre off: 0.5 m / sqrt(80) = 0.056 m, a little less after the fit.
    assert!((0.05..0.056).contains(&trajectory.absolute[1].position_m.rms), "{:?}", trajectory.absolute[1]);
    assert!((trajectory.worst[0][0] - 4.0).abs() < 1e-9 && trajectory.worst[0][1] > 0.45);
    assert_eq!(trajectory.relative.len(), 3, "80 poses in 8 s have steps of a pose, a second and a metre");
    let page = std::fs::read_to_string(file("out/report.html")).unwrap();
    assert!(page.contains("Paths") && page.contains("Position error over time"));
}

#[test]
fn output_folders_are_compared_part_by_part() {
    let folder = tempfile::tempdir().unwrap();
    let make = |name: &str, shift: f64| -> PathBuf {
        let path = folder.path().join(name);
        std::fs::create_dir(&path).unwrap();
        write_any_cloud(path.join("cloud.ply"), &cloud(corner()), Precision::Single).unwrap();
        let station = |station: &str| Station {
            station: station.into(),
            world_from_camera: Isometry3::translation(shift, 0.0, 0.0),
            sigma_position_m: None,
            sigma_attitude_rad: None,
            doubt: None,
        };
        write_stations(path.join("stations.csv"), &[station("S00"), station(name)]).unwrap();
        path
    };
    let (a, b) = (make("a", 0.25), make("b", 0.0));
    let comparison = run(&CompareRequest::new(&a, &b));
    assert!(comparison.clouds.is_some() && comparison.trajectory.is_none());
    let poses = comparison.poses.unwrap();
    assert_eq!((poses.poses, poses.only_first, poses.only_second), (1, 1, 1));
    assert!((poses.position_max_m - 0.25).abs() < 1e-12);
    let alone = run(&CompareRequest::new(a.join("cloud.ply"), &b));
    assert!(alone.clouds.is_some() && alone.poses.is_none(), "a file against the folder's part of its kind");
}

#[test]
fn what_does_not_belong_together_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    write_any_cloud(file("a.ply"), &cloud(corner()), Precision::Single).unwrap();
    write_any_trajectory(file("t.txt"), &track(), TrajectoryFormat::Tum).unwrap();
    let message = fault(&file("a.ply"), &file("t.txt"));
    assert!(message.contains("a.ply is a point cloud and ") && message.contains("t.txt is a trajectory"), "{message}");
    std::fs::write(file("words.txt"), "hello\n").unwrap();
    let message = fault(&file("words.txt"), &file("t.txt"));
    assert!(message.contains("words.txt is nothing that can be compared, expected a point cloud"), "{message}");
    assert!(fault(&file("missing.ply"), &file("a.ply")).contains("missing.ply: cannot open"));
    let late: Vec<_> =
        track().into_iter().map(|pose| StampedPose { timestamp_s: pose.timestamp_s + 100.0, ..pose }).collect();
    write_any_trajectory(file("late.txt"), &late, TrajectoryFormat::Tum).unwrap();
    let message = fault(&file("late.txt"), &file("t.txt"));
    assert!(
        message.contains("late.txt against") && message.contains("no pose of the estimate (100.000 s"),
        "{message}"
    );
    let mut flagged = cloud(corner());
    flagged.flags = Some(vec![1; flagged.len()]);
    write_any_cloud(file("flagged.ply"), &flagged, Precision::Single).unwrap();
    let message = fault(&file("flagged.ply"), &file("a.ply"));
    assert!(message.contains("all of its 30000 are flagged"), "{message}");
}
