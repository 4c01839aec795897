//! Tracks a simulated sequence and, where it is at hand, a real one; prints CPU time a frame and errors.
//!
//! `cargo run --release -p tracking --example track_sequence -- [option=value ..]`
//!
//! Options: `folder` (of the real sequence), `simulated=off`, `seed` (of the simulated noise), `keyframe_overlap`, `max_keyframes`,
//! `loop_attempts`, `window=20` (squared errors over variances of paths of so many frames instead), `noise_fraction`, `max_iterations`, `max_motion_sigma_m`, `every=1` (a line a frame);
//! `sensors=20` (paths of so many simulated sensors whose ranges err alike in all frames, instead);
//! of the real sequence `first` (frame), `count`, `backwards=1` and `hertz` (30); `invalid=scattered` or `clumps`: a fifth of all pixels
//! is lost.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]

#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;
#[path = "../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;
#[path = "../tests/sequence/mod.rs"]
mod sequence;

use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use common::Pinhole;
use common::invalid::{Loss, lose};
use common::sensor::{distort, drawn};
use cpu_clock::cpu_seconds;
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, UnitQuaternion};
use projective_registration::Projection;
use sequence::{absolute_error, around, frame_at, normalised_error, poses, projection, relative_error};
use tracking::{TrackedPose, Tracker, TrackerOptions, TrackingState};

/// Value of an option `name=value` of the command line.
fn argument<T: FromStr>(name: &str) -> Option<T> {
    std::env::args().skip(1).find_map(|argument| argument.strip_prefix(name)?.strip_prefix('=')?.parse().ok())
}

fn options() -> TrackerOptions {
    let mut options = TrackerOptions::default();
    options.keyframe_overlap = argument("keyframe_overlap").unwrap_or(options.keyframe_overlap);
    options.max_keyframes = argument("max_keyframes").unwrap_or(options.max_keyframes);
    options.loop_attempts = argument("loop_attempts").unwrap_or(options.loop_attempts);
    options.alignment.max_motion_sigma_m = argument("max_motion_sigma_m").or(options.alignment.max_motion_sigma_m);
    options.alignment.max_iterations = argument("max_iterations").unwrap_or(options.alignment.max_iterations);
    options.alignment.noise_fraction = argument("noise_fraction").or(options.alignment.noise_fraction);
    options
}

fn loss() -> Loss {
    match argument::<String>("invalid").as_deref() {
        Some("scattered") => Loss::Scattered,
        Some("clumps") => Loss::Clumps,
        _ => Loss::None,
    }
}

/// Tracks frame by frame; also the CPU time of each, milliseconds.
fn track(
    projection: &Arc<Projection>,
    count: usize,
    seconds: impl Fn(usize) -> f64,
    mut frame: impl FnMut(usize) -> (Vec<[f64; 3]>, Option<Vec<f32>>),
) -> (Tracker, Vec<f64>) {
    let mut tracker = Tracker::new(projection, options()).unwrap();
    let mut times = Vec::new();
    for k in 0..count {
        let (mut points, sigma) = frame(k);
        lose(&mut points, projection.width(), loss(), 0.2, k as u64);
        let start = cpu_seconds();
        let pose = tracker.track(seconds(k), &points, sigma.as_deref(), None).unwrap();
        times.push(1e3 * (cpu_seconds() - start));
        if argument::<usize>("every").is_some() {
            println!(
                "{k} {:?} sigma {:.2} mm keyframe {} overlap {:.3} rms {:.2} mm {:.2} ms",
                pose.state,
                1e3 * pose.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt(),
                pose.keyframe,
                pose.overlap,
                1e3 * pose.rms_m,
                times[k]
            );
        }
    }
    (tracker, times)
}

/// Standard deviations of the real sequence's reference, metre and radian along an axis: 8 mm, 0.3 degrees a pair.
fn of_reference() -> [f64; 2] {
    [8e-3, 0.3_f64.to_radians()].map(|sigma| sigma / 3.0_f64.sqrt())
}

/// Mean of the squared errors over their variances by axis, the reference's own error added.
fn by_axis(tracked: &[TrackedPose], truth: &[Isometry3<f64>], reference: [f64; 2]) -> [f64; 6] {
    let mut sums = [0.0; 6];
    for (pose, truth) in tracked.iter().zip(truth).skip(1) {
        let error = rigid_pose::pose_difference(&pose.world_from_camera, truth);
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += error[k].powi(2) / (pose.covariance[(k, k)] + reference[k / 3].powi(2));
        }
    }
    sums.map(|sum| sum / (tracked.len() - 1) as f64)
}

fn report(name: &str, tracker: &Tracker, times: &mut [f64], truth: &[Isometry3<f64>]) {
    let online = tracker.trajectory();
    let lost = online.iter().filter(|pose| matches!(pose.state, TrackingState::Lost(_))).count();
    let (adjusted, world) = (poses(&tracker.adjusted_trajectory()), truth[0]);
    let errors = |estimate: &[Isometry3<f64>]| {
        let (rms, largest) = absolute_error(estimate, truth);
        let (metre, radian) = relative_error(estimate, truth, 1);
        format!(
            "ATE {:.2} mm (largest {:.2}), RPE {:.2} mm {:.3} deg a frame",
            1e3 * rms,
            1e3 * largest,
            1e3 * metre,
            radian.to_degrees()
        )
    };
    println!(
        "{name}: {} frames, {lost} lost, {} keyframes, {} registrations between them",
        online.len(),
        tracker.keyframes(),
        tracker.registrations()
    );
    println!("  as tracked: {}", errors(&poses(online)));
    println!("  adjusted:   {}", errors(&adjusted));
    let in_world: Vec<TrackedPose> = online.to_vec();
    let from_first: Vec<Isometry3<f64>> = truth.iter().map(|pose| world.inverse() * pose).collect();
    println!("  normalised squared error {:.2} (6 expected)", normalised_error(&in_world, &from_first));
    println!("  squared error over variance by axis {:.2?}", by_axis(&in_world, &from_first, of_reference()));
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    times.sort_by(f64::total_cmp);
    println!(
        "  CPU a frame: mean {mean:.2} ms, median {:.2}, 95 % {:.2}, largest {:.2}; {:.0} frames/s",
        times[times.len() / 2],
        times[times.len() * 95 / 100],
        times[times.len() - 1],
        1e3 / mean
    );
}

fn simulated(camera: &Pinhole, name: &str) {
    let seed: u64 = argument("seed").unwrap_or(40_000);
    let truth: Vec<Isometry3<f64>> = (0..300).map(around).collect();
    let frame = |k: usize| {
        let (points, sigma) = frame_at(camera, &truth[k], seed + k as u64);
        (points, Some(sigma))
    };
    let (tracker, mut times) = track(&projection(camera), truth.len(), |k| k as f64 / sequence::HERTZ, frame);
    report(name, &tracker, &mut times, &truth);
}

/// Squared errors over variances of the paths of simulated sensors, whose ranges err alike in all frames, each in its own way:
/// mean over the sensors by axis, and the largest share of it that comes from a single sensor.
fn sensors(count: u64) {
    const FRAMES: usize = 500;
    let camera = Pinhole { width: 88, height: 72, focal_px: 76.0 };
    let (projection, path) = (projection(&camera), (0..FRAMES).map(around).collect::<Vec<_>>());
    for size in [20, 100, FRAMES] {
        let mut of_sensors = Vec::new();
        for sensor in 0..count {
            let field = drawn(9_000 + sensor);
            let mut sums = [0.0; 6];
            let starts: Vec<usize> = (0..FRAMES).step_by(100.max(size)).collect();
            for &first in &starts {
                let frame = |k: usize| {
                    let (mut points, sigma) = frame_at(&camera, &path[first + k], 1000 * sensor + (first + k) as u64);
                    distort(&mut points, &camera, &field);
                    (points, Some(sigma))
                };
                let (tracker, _) = track(&projection, size, |k| k as f64 / sequence::HERTZ, frame);
                let truth: Vec<_> = path[first..first + size].iter().map(|pose| path[first].inverse() * pose).collect();
                let axes = by_axis(tracker.trajectory(), &truth, [0.0; 2]);
                sums.iter_mut().zip(axes).for_each(|(sum, axis)| *sum += axis / starts.len() as f64);
            }
            of_sensors.push(sums);
        }
        let mean: [f64; 6] = std::array::from_fn(|k| of_sensors.iter().map(|s| s[k]).sum::<f64>() / count as f64);
        let mut every: Vec<f64> = of_sensors.into_iter().flatten().collect();
        every.sort_by(f64::total_cmp);
        let at = |share: f64| every[(share * (every.len() - 1) as f64) as usize];
        println!(
            "squared error over variance by axis, {count} sensors, {size} frames: {mean:.2?}; of one sensor and axis 5 % below {:.2}, median {:.2}, 95 % below {:.2}",
            at(0.05),
            at(0.5),
            at(0.95)
        );
    }
}

/// Depth in millimetre as points of a camera that looks along -z with y up.
fn depth_points(path: &Path, focal: f64, centre: [f64; 2]) -> Vec<[f64; 3]> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let values = bytes.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]]));
    let point = |(k, value): (usize, u16)| {
        if value == 0 || value == u16::MAX {
            return [f64::NAN; 3];
        }
        let depth = 1e-3 * f64::from(value);
        let (col, row) = ((k % info.width as usize) as f64, (k / info.width as usize) as f64);
        [(col - centre[0]) / focal * depth, (centre[1] - row) / focal * depth, -depth]
    };
    values.enumerate().map(point).collect()
}

/// A pose file: 4x4, computer-vision axes.
fn pose(path: &Path) -> Isometry3<f64> {
    let text = std::fs::read_to_string(path).unwrap();
    let m = Matrix4::from_row_iterator(text.split_whitespace().map(|word| word.parse::<f64>().unwrap()));
    let flip = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, -1.0, -1.0));
    let rotation = Rotation3::from_matrix(&(m.fixed_view::<3, 3>(0, 0) * flip));
    let translation = nalgebra::Vector3::new(m[(0, 3)], m[(1, 3)], m[(2, 3)]);
    Isometry3::from_parts(translation.into(), UnitQuaternion::from_rotation_matrix(&rotation))
}

fn real(folder: &Path) {
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".depth.png"))
        .collect();
    names.sort();
    if argument::<usize>("backwards").is_some() {
        names.reverse();
    }
    names.drain(..argument::<usize>("first").unwrap_or(0).min(names.len()));
    names.truncate(argument("count").unwrap_or(names.len()));
    if names.is_empty() {
        println!("no frames in {}", folder.display());
        return;
    }
    let number = |k: usize| names[k]["frame-".len()..].split('.').next().unwrap().parse::<f64>().unwrap();
    let hertz = argument("hertz").unwrap_or(30.0);
    let truth: Vec<_> = names.iter().map(|name| pose(&folder.join(name.replace("depth.png", "pose.txt")))).collect();
    let projection = Arc::new(Projection::pinhole(640, 480, [585.0; 2], [320.0, 240.0]).unwrap());
    let frame = |k: usize| (depth_points(&folder.join(&names[k]), 585.0, [320.0, 240.0]), None);
    if let Some(size) = argument::<usize>("window") {
        let mut sums = [0.0; 6];
        let starts = (0..=names.len().saturating_sub(size)).step_by(size.max(1));
        let windows = (names.len() / size) as f64;
        for first in starts {
            let (tracker, _) =
                track(&projection, size, |k| (number(first + k) - number(first)).abs() / hertz, |k| frame(first + k));
            let from_first: Vec<_> =
                truth[first..first + size].iter().map(|pose| truth[first].inverse() * pose).collect();
            let axes = by_axis(tracker.trajectory(), &from_first, of_reference());
            sums.iter_mut().zip(axes).for_each(|(sum, axis)| *sum += axis / windows);
        }
        println!("squared error over variance by axis, {windows} windows of {size} frames: {sums:.2?}");
        return;
    }
    let (tracker, mut times) = track(&projection, names.len(), |k| (number(k) - number(0)).abs() / hertz, frame);
    report("7-Scenes red kitchen, kept frames", &tracker, &mut times, &truth);
}

fn main() {
    // The clock is that of one thread: all work is done on it.
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(run);
}

fn run() {
    if let Some(count) = argument("sensors") {
        sensors(count);
        return;
    }
    if argument::<String>("simulated").is_none_or(|simulated| simulated != "off") {
        simulated(&Pinhole::small(), "simulated room 176x144");
    }
    let folder = argument::<String>("folder")
        .unwrap_or_else(|| concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/real/sevenscenes_redkitchen").into());
    real(Path::new(&folder));
}
