//! By a tracker: the mounting, stations at all times, and files that are wrong as a whole.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use nalgebra::{Isometry3, Vector3};
use orientation_tasks::pipeline::{DoubtKind, Failure, Judged};
use orientation_tasks::{OrientBy, OrientSummary, TrackerOptions};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

use crate::scene::{noisy, oriented, path, stations, timed};

/// Ahead of the camera's clock, second.
const OFFSET_S: f64 = 0.12;

fn mounting() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.06, -0.02, 0.11), Vector3::new(0.3, -0.2, 1.5))
}

/// A survey of 30 stations, of which every third is known, with a tracker's poses at 50 Hz as lines of numbers.
struct World {
    folder: tempfile::TempDir,
    survey: PathBuf,
    poses: Vec<[f64; 8]>,
}

fn world(seed: u64, offset_s: f64) -> World {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Pcg64::seed_from_u64(seed);
    let times: Vec<f64> = (0..30).map(|index| 1.0 + 0.31 * f64::from(index)).collect();
    let known: Vec<(usize, Isometry3<f64>)> =
        (0..30).step_by(2).map(|index| (index, noisy(&path(times[index]), [0.002, 0.001], &mut random))).collect();
    let survey = timed(folder.path(), &times, &known);
    let world = Isometry3::new(Vector3::new(4.0, -2.0, 0.5), Vector3::new(0.1, 0.2, 2.0));
    let pose = |index: u32| {
        let t = 0.02 * f64::from(index);
        let carrier = noisy(&(world * path(t) * mounting().inverse()), [0.002, 0.001], &mut random);
        let (p, q) = (carrier.translation.vector, carrier.rotation);
        [t + offset_s, p.x, p.y, p.z, q.i, q.j, q.k, q.w]
    };
    let poses = (0..600).map(pose).collect();
    World { folder, survey, poses }
}

fn write(file: &Path, poses: &[[f64; 8]]) {
    let mut text = String::new();
    for pose in poses {
        writeln!(text, "{}", pose.map(|value| value.to_string()).join(" ")).unwrap();
    }
    std::fs::write(file, text).unwrap();
}

impl World {
    fn options(&self, change: impl Fn(usize, [f64; 8]) -> [f64; 8]) -> TrackerOptions {
        let file = self.folder.path().join("tracker.txt");
        let poses: Vec<[f64; 8]> = self.poses.iter().enumerate().map(|(index, pose)| change(index, *pose)).collect();
        write(&file, &poses);
        TrackerOptions { sigma_position_m: 0.002, sigma_attitude_rad: 0.001, ..TrackerOptions::new(file) }
    }

    fn orient(&self, change: impl Fn(usize, [f64; 8]) -> [f64; 8]) -> Result<OrientSummary, String> {
        let options = self.options(change);
        oriented(&self.survey, OrientBy::Tracker(options)).map_err(|error| {
            assert_eq!(error.failure(), Failure::Usage, "{error}");
            error.to_string()
        })
    }
}

/// Squares of the errors of positions over their variances, mean per axis.
fn normalised(survey: &Path) -> f64 {
    let found = stations(survey);
    let squares = found.iter().enumerate().map(|(index, station)| {
        let truth = path(1.0 + 0.31 * index as f64).translation.vector;
        let off = station.world_from_camera.translation.vector - truth;
        let sigma = station.sigma_position_m.unwrap();
        (0..3).map(|axis| (off[axis] / sigma[axis]).powi(2)).sum::<f64>() / 3.0
    });
    squares.sum::<f64>() / found.len() as f64
}

#[test]
fn all_stations_get_poses_with_deviations_that_hold() {
    let mut sum = 0.0;
    for seed in 0..20 {
        let world = world(seed, 0.0);
        let summary = world.orient(|_, pose| pose).unwrap();
        assert_eq!((summary.stations.len(), summary.not_oriented.len()), (30, 0), "{summary}");
        let found = summary.mounting.as_ref().unwrap();
        let off = Vector3::from(found.lever_arm_m) - mounting().translation.vector;
        assert!(off.norm() < 0.02, "{off}");
        sum += normalised(&world.survey) / 20.0;
    }
    println!("normalised square {sum:.2}");
    // Poses between two of the tracker's are better than one of them: interpolated at fixed shares, a little pessimistic.
    assert!((0.6..1.4).contains(&sum), "{sum}");
}

#[test]
fn clocks_that_differ_are_brought_together() {
    let world = world(3, OFFSET_S);
    let options = TrackerOptions { time_offset_within_s: Some(0.5), ..world.options(|_, pose| pose) };
    let summary = oriented(&world.survey, OrientBy::Tracker(options)).unwrap();
    println!("{summary}");
    let [offset, sigma] = summary.mounting.as_ref().unwrap().time_offset_s.unwrap();
    assert!((offset - OFFSET_S).abs() < 4.0 * sigma && sigma < 0.01, "{offset} {sigma}");
    assert!(normalised(&world.survey) < 2.5);
}

type Change = fn(usize, [f64; 8]) -> [f64; 8];

#[test]
fn every_slip_of_a_whole_file_is_named() {
    let world = world(5, 0.0);
    let slips: [(Change, &str); 6] = [
        (|_, [t, x, y, z, a, b, c, d]| [t, 1e3 * x, 1e3 * y, 1e3 * z, a, b, c, d], "millimetres"),
        (|_, [t, x, y, z, a, b, c, d]| [t, x, y, z, d, a, b, c], "w first"),
        (|_, [t, x, y, z, a, b, c, d]| [t + 1e6, x, y, z, a, b, c, d], "clocks do not overlap"),
        (|_, [t, x, y, z, a, b, c, d]| [1e9 * t, x, y, z, a, b, c, d], "nanoseconds"),
        (
            |_, [t, x, y, z, a, b, c, d]| {
                let pose = Isometry3::from_parts(
                    nalgebra::Translation3::new(x, y, z),
                    nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(d, a, b, c)),
                );
                let back = pose.inverse();
                let (p, q) = (back.translation.vector, back.rotation);
                [t, p.x, p.y, p.z, q.i, q.j, q.k, q.w]
            },
            "the other way round",
        ),
        (|_, [_, x, y, z, a, b, c, d]| [1.0, x, y, z, a, b, c, d], "not later"),
    ];
    for (slip, words) in slips {
        let error = world.orient(slip).unwrap_err();
        println!("{error}");
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn one_wild_pose_is_named() {
    let world = world(8, 0.0);
    // Known station S08 stands at 3.48 s, between poses 173 and 174 + 1.
    let summary = world.orient(|index, [t, x, y, z, a, b, c, d]| {
        let wild = if (172..=176).contains(&index) { 0.4 } else { 0.0 };
        [t, x + wild, y, z, a, b, c, d]
    });
    let summary = summary.unwrap();
    let named: Vec<_> = summary.rejected.iter().map(|value| value.station.as_str()).collect();
    assert_eq!(named, ["S08"], "{summary}");
    assert!(summary.doubts().iter().any(|doubt| doubt.kind == DoubtKind::Contradiction), "{:?}", summary.doubts());
}

#[test]
fn frames_outside_the_tracker_are_named() {
    let mut world = world(9, 0.0);
    world.poses.truncate(400);
    let summary = world.orient(|_, pose| pose).unwrap();
    // 400 poses end at 7.98 s; station S23 stands at 8.13 s.
    assert_eq!((summary.stations.len(), summary.not_oriented[0].station.as_str()), (23, "S23"), "{summary}");
}
