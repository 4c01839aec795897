//! A recorded inertial unit against its poses as something better measured them: `recorded_unit UNIT POSES [SIGMA_M SIGMA_DEG]`, an
//! `EuRoC` folder and a trajectory of the unit.
//!
//! In every window of 5 s poses 0.2 s apart are taken as known so well (0.002 m, 0.05 degrees); where the unit then is by itself for 2 s
//! is held against the trajectory and the stated deviations.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use camera_model::with_computer_vision_axes;
use nalgebra::Isometry3;
use orientation_tasks::pipeline::Silent;
use orientation_tasks::{OrientBy, OrientRequest, orient};
use range_io::tables::{Station, read_stations, write_stations};
use range_io::trajectory::{StampedPose, read_any_trajectory};

/// Known poses, every so many seconds, and seconds between windows.
const KNOWN: usize = 26;
const EVERY_S: f64 = 0.2;
const WINDOWS_S: f64 = 5.0;
/// Seconds by the unit alone.
const ALONE_S: [f64; 4] = [0.2, 0.5, 1.0, 2.0];

/// Of one horizon: squared errors of positions over their variances, errors and deviations, of each window.
#[derive(Default)]
struct Horizon {
    squares: Vec<f64>,
    errors_m: Vec<f64>,
    sigmas_m: Vec<f64>,
    turns_deg: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [unit, poses] = [0, 1].map(|index| arguments.get(index).map(PathBuf::from));
    let (Some(unit), Some(poses)) = (unit, poses) else {
        return Err("expected an EuRoC folder and a trajectory".into());
    };
    let number = |index: usize, default: f64| arguments.get(index).map_or(Ok(default), |text| text.parse());
    let sigmas = [number(2, 0.002)?, number(3, 0.05)?.to_radians()];
    let truth = read_any_trajectory(poses)?;
    let (Some(first), Some(last)) = (truth.first(), truth.last()) else { return Err("no poses".into()) };
    let mut horizons: [Horizon; 4] = Default::default();
    let (mut start_s, mut windows, mut contradicted) = (first.timestamp_s + 1.0, 0, 0);
    while start_s + WINDOWS_S + 2.5 < last.timestamp_s {
        contradicted += usize::from(window(&unit, &truth, start_s, sigmas, &mut horizons)?);
        (start_s, windows) = (start_s + WINDOWS_S, windows + 1);
    }
    println!("{windows} windows, {contradicted} with poses that the unit contradicts");
    println!(
        "after, s   squared error / variance: mean, median   position off, m: rms, stated   attitude off, degree: rms"
    );
    for (seconds, horizon) in ALONE_S.iter().zip(&mut horizons) {
        let rms = |values: &[f64]| (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
        let mean = horizon.squares.iter().sum::<f64>() / horizon.squares.len() as f64;
        horizon.squares.sort_by(f64::total_cmp);
        let median = horizon.squares[horizon.squares.len() / 2];
        let (off, stated, turned) = (rms(&horizon.errors_m), rms(&horizon.sigmas_m), rms(&horizon.turns_deg));
        println!("{seconds:8.1} {mean:40.2} {median:7.2} {off:25.4} {stated:7.4} {turned:25.3}");
    }
    Ok(())
}

/// Orients the stations of one window by the command; whether some of its poses contradict the unit.
fn window(
    unit: &Path,
    truth: &[StampedPose],
    start_s: f64,
    [sigma_m, sigma_rad]: [f64; 2],
    horizons: &mut [Horizon; 4],
) -> Result<bool, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let survey = folder.path().join("survey");
    std::fs::create_dir_all(survey.join("unit/imu0"))?;
    for name in ["data.csv", "sensor.yaml"] {
        let from = ["", "imu0", "mav0/imu0"].map(|inside| unit.join(inside).join(name));
        if let Some(from) = from.iter().find(|file| file.is_file()) {
            std::fs::copy(from, survey.join("unit/imu0").join(name))?;
        }
    }
    let last_s = start_s + EVERY_S * (KNOWN - 1) as f64;
    let times = (0..KNOWN).map(|k| start_s + EVERY_S * k as f64).chain(ALONE_S.map(|seconds| last_s + seconds));
    let near = |time_s: f64| &truth[truth.partition_point(|pose| pose.timestamp_s < time_s).min(truth.len() - 1)];
    let chosen: Vec<&StampedPose> = times.map(near).collect();
    let mut frames = String::new();
    for (index, pose) in chosen.iter().enumerate() {
        write!(frames, "(file: \"{index}.npz\", station: \"S{index:02}\", timestamp_s: {:?}),", pose.timestamp_s)?;
    }
    let camera = "width: 176, height: 144, pixel_pitch_mm: (0.04, 0.04), principal_distance_mm: 8.0, principal_point_mm: (0.0, 0.0)";
    let text = format!(
        "#![enable(implicit_some)]\n(camera: ({camera}), level: range, extras: {{\"imu\": \"unit\"}}, frames: [{frames}])"
    );
    std::fs::write(survey.join("survey.ron"), text)?;
    // Readers of trajectories turn the axes of a camera; those of the unit are its own.
    let pose = |pose: &StampedPose| -> Isometry3<f64> { with_computer_vision_axes(&pose.world_from_camera) };
    let known: Vec<Station> = (0..KNOWN)
        .map(|index| Station {
            station: format!("S{index:02}"),
            world_from_camera: pose(chosen[index]),
            sigma_position_m: Some([sigma_m; 3]),
            sigma_attitude_rad: Some([sigma_rad; 3]),
            doubt: None,
        })
        .collect();
    write_stations(survey.join("stations.csv"), &known)?;
    let request =
        OrientRequest { survey, by: OrientBy::Imu { known: None }, calibration: None, out: folder.path().join("out") };
    let summary = orient(&request, &Silent)?;
    let found = read_stations(request.out.join("stations.csv"))?;
    for (index, horizon) in horizons.iter_mut().enumerate() {
        let name = format!("S{:02}", KNOWN + index);
        let station = found.iter().find(|station| station.station == name).ok_or("a station was not oriented")?;
        let (there, sigma) = (pose(chosen[KNOWN + index]), station.sigma_position_m.unwrap_or([f64::NAN; 3]));
        let off = station.world_from_camera.translation.vector - there.translation.vector;
        horizon.squares.push((0..3).map(|axis| (off[axis] / sigma[axis]).powi(2)).sum::<f64>() / 3.0);
        horizon.errors_m.push(off.norm());
        horizon.sigmas_m.push(sigma.iter().map(|sigma| sigma * sigma).sum::<f64>().sqrt());
        horizon.turns_deg.push(station.world_from_camera.rotation.angle_to(&there.rotation).to_degrees());
    }
    Ok(summary.doubts.iter().any(|doubt| doubt.words.contains("measured another motion")))
}
