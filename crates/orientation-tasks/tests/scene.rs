//! Surveys that the tests share.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use camera_model::pose_from_euler;
use nalgebra::{Isometry3, Vector3, Vector6};
use orientation_tasks::pipeline::{Result, Silent};
use orientation_tasks::{OrientBy, OrientRequest, OrientSummary, orient};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_io::tables::{Station, read_stations, write_stations};
use rigid_pose::step_pose;

pub fn target_field() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/surveys/target_field")
}

/// The target field with the true coordinates of its targets.
pub fn field(folder: &Path) -> PathBuf {
    let survey = folder.join("survey");
    std::fs::create_dir_all(&survey).unwrap();
    for (from, to) in [
        ("survey.ron", "survey.ron"),
        ("observations.csv", "observations.csv"),
        ("truth/targets.csv", "targets.csv"),
        ("truth/calibration.ron", "calibration.ron"),
    ] {
        std::fs::copy(target_field().join(from), survey.join(to)).unwrap();
    }
    let text = std::fs::read_to_string(survey.join("survey.ron")).unwrap();
    let line = text.lines().find(|line| line.contains("truth:")).unwrap();
    std::fs::write(survey.join("survey.ron"), text.replace(line, "")).unwrap();
    survey
}

/// Changes a file's lines behind the first; `None` leaves one out.
pub fn edit(file: &Path, change: impl Fn(usize, &[&str]) -> Option<Vec<String>>) {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let mut changed = lines.next().unwrap().to_owned() + "\n";
    for (index, line) in lines.enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        if let Some(fields) = change(index, &fields) {
            writeln!(changed, "{}", fields.join(",")).unwrap();
        }
    }
    std::fs::write(file, changed).unwrap();
}

pub fn by_targets(survey: &Path) -> Result<OrientSummary> {
    oriented(survey, OrientBy::Targets { sigma_pixel: None, sigma_range_m: None })
}

pub fn oriented(survey: &Path, by: OrientBy) -> Result<OrientSummary> {
    let out = survey.with_file_name("oriented");
    orient(&OrientRequest { survey: survey.to_owned(), by, calibration: None, out }, &Silent)
}

/// A moving camera.
pub fn path(t: f64) -> Isometry3<f64> {
    let turn = [1.4 + 0.25 * (0.9 * t).sin(), 0.3 * (0.7 * t).sin(), 0.2 * (1.1 * t).cos()];
    pose_from_euler(Vector3::new(0.6 * (0.5 * t).sin(), 0.4 * (0.8 * t).cos(), 1.2 + 0.2 * (0.6 * t).sin()), turn)
}

/// A survey of frames at these times (no files: their times alone are read), and some known stations.
pub fn timed(folder: &Path, times: &[f64], known: &[(usize, Isometry3<f64>)]) -> PathBuf {
    let survey = folder.join("survey");
    std::fs::create_dir_all(&survey).unwrap();
    let mut frames = String::new();
    for (index, time) in times.iter().enumerate() {
        writeln!(frames, "(file: \"{index}.npz\", station: \"S{index:02}\", timestamp_s: {time}),").unwrap();
    }
    let text = format!(
        "#![enable(implicit_some)]\n(camera: (width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0, \
         principal_point_mm: (0.0, 0.0)), level: range, frames: [{frames}])"
    );
    std::fs::write(survey.join("survey.ron"), text).unwrap();
    let station = |(index, pose): &(usize, Isometry3<f64>)| Station {
        station: format!("S{index:02}"),
        world_from_camera: *pose,
        sigma_position_m: Some([0.002; 3]),
        sigma_attitude_rad: Some([0.001; 3]),
        doubt: None,
    };
    write_stations(survey.join("stations.csv"), &known.iter().map(station).collect::<Vec<_>>()).unwrap();
    survey
}

/// The stations of a result.
pub fn stations(survey: &Path) -> Vec<Station> {
    read_stations(survey.with_file_name("oriented").join("stations.csv")).unwrap()
}

/// A pose off by standard deviations of position, metre, and attitude, radian.
pub fn noisy(pose: &Isometry3<f64>, [position_m, attitude_rad]: [f64; 2], random: &mut Pcg64) -> Isometry3<f64> {
    let step = Vector6::from_fn(|axis, _| {
        let normal: f64 = StandardNormal.sample(random);
        normal * if axis < 3 { position_m } else { attitude_rad }
    });
    step_pose(pose, &step)
}
