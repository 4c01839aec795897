//! A moving scene for `cargo xtask peers frame`, and what this crate makes of it.
//!
//! `peers_frame simulate FOLDER FRAMES COLUMNS ROWS` writes raw samples, calibration and truth; `peers_frame run FOLDER FRAMES COLUMNS
//! ROWS` takes the frames to points without and with poses and prints `frame CPU-ms CPU-ms-with-poses` for each, then errors against the truth: `range
//! median-mm wrong-% median-mm-of-sure wrong-%-of-sure`, `lost frames`. Positions beside true ones go to `positions.txt`.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic)]

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // each user takes a part of it
mod common;
#[path = "../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;

use std::path::{Path, PathBuf};

use common::{INTERVAL_S, Sequence, model};
use cpu_clock::cpu_seconds;
use live_frames::camera_model::RayTable;
use live_frames::range_image::{Flags, Samples};
use live_frames::tracking::TrackerOptions;
use live_frames::tracking::nalgebra::{Isometry3, Matrix4};
use live_frames::{Limits, Processor, Stages};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [command, folder, frames, width, height] = words.as_slice() else { panic!("see the head of this file") };
    let number = |word: &String| word.parse::<usize>().unwrap();
    let sequence = Sequence { width: number(width), height: number(height), rays: 1, ..Sequence::default() };
    match command.as_str() {
        "simulate" => simulate(&sequence, Path::new(folder), number(frames)),
        // On the thread whose clock is read: frames go to the threads of a pool.
        "run" => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            pool.install(|| run(&sequence, Path::new(folder), number(frames)));
        }
        other => panic!("{other}: expected simulate or run"),
    }
}

fn file(folder: &Path, name: &str, number: usize) -> PathBuf {
    folder.join(format!("{name}_{number:03}"))
}

fn bytes<T: Copy, const N: usize>(values: &[T], of: fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|value| of(*value)).collect()
}

/// Each row is a pose, sixteen numbers row by row.
fn pose_line(pose: &Isometry3<f64>) -> String {
    let matrix: Matrix4<f64> = pose.to_homogeneous();
    let numbers: Vec<String> = matrix.transpose().iter().map(ToString::to_string).collect();
    numbers.join(" ") + "\n"
}

fn simulate(sequence: &Sequence, folder: &Path, frames: usize) {
    let mut poses = String::new();
    for number in 0..frames {
        let frame = sequence.frame(number);
        let Samples::F32(samples) = frame.raw.samples() else { panic!("samples are not digitised") };
        // As a camera delivers them.
        let samples: Vec<u16> = samples.iter().map(|value| value.round() as u16).collect();
        std::fs::write(file(folder, "samples", number), bytes(&samples, u16::to_le_bytes)).unwrap();
        std::fs::write(file(folder, "truth", number), bytes(frame.truth.range.as_slice(), f32::to_le_bytes)).unwrap();
        poses += &pose_line(&frame.truth.world_from_camera);
    }
    std::fs::write(folder.join("poses.txt"), poses).unwrap();
    let calibration = sequence.calibration();
    let rays = RayTable::new(&calibration.camera().unwrap()).unwrap();
    let flat: Vec<f64> = rays.directions().iter().flatten().copied().collect();
    std::fs::write(folder.join("rays"), bytes(&flat, f64::to_le_bytes)).unwrap();
    let pattern = calibration.fixed_pattern.unwrap();
    std::fs::write(folder.join("pattern"), bytes(&pattern.offset_m, f32::to_le_bytes)).unwrap();
    std::fs::write(folder.join("camera.txt"), camera(sequence)).unwrap();
}

/// The calibration as `name number...`.
fn camera(sequence: &Sequence) -> String {
    let interval_m = sequence.camera().modulations[0].ambiguity_interval_m();
    let model = model(interval_m);
    let (terms, hyperbola) = (model.terms, model.hyperbola.unwrap());
    let live_frames::range_image::NoiseModel { shot_variance_per_unit, dark_sigma } =
        sequence.calibration().noise.unwrap();
    let periodic = terms.periodic.map(|value| value.to_string()).join(" ");
    let pitch_mm = 6.4 / sequence.width as f64;
    format!(
        "interval_m {interval_m}\nd0 {}\nperiodic {periodic}\ne {} {}\nhyperbola {} {} {}\nnoise {shot_variance_per_unit} {dark_sigma}\n\
         scattering 0.05 9\npitch_mm {pitch_mm}\nprincipal_point_mm 0.05 -0.03\n",
        terms.d0, terms.e1, terms.e2, hyperbola.h1, hyperbola.h2, hyperbola.h3
    )
}

fn run(sequence: &Sequence, folder: &Path, frames: usize) {
    let (camera, calibration) = (sequence.camera(), sequence.calibration());
    let tracking = Stages { tracking: Some(TrackerOptions::default()), ..Stages::default() };
    let new = |stages| Processor::new(&camera, &calibration, stages, Limits::default()).unwrap();
    let (mut alone, mut tracked) = (new(Stages::default()), new(tracking));
    let interval_m = camera.modulations[0].ambiguity_interval_m();
    let truths = std::fs::read_to_string(folder.join("poses.txt")).unwrap();
    let (mut errors, mut lost, mut path) = ([Vec::new(), Vec::new()], 0, Vec::new());
    let mut wrong = [0_usize; 2];
    for number in 0..frames {
        let raw = std::fs::read(file(folder, "samples", number)).unwrap();
        let samples: Vec<u16> = raw.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let timed = |processor: &mut Processor| {
            let begin = cpu_seconds();
            processor.process(samples.as_slice(), number as f64 * INTERVAL_S).unwrap();
            1e3 * (cpu_seconds() - begin)
        };
        let milliseconds = timed(&mut alone);
        println!("frame {milliseconds} {}", timed(&mut tracked));
        let frame = tracked.last();
        let truth = std::fs::read(file(folder, "truth", number)).unwrap();
        let truth = truth.chunks_exact(4).map(|four| f32::from_le_bytes([four[0], four[1], four[2], four[3]]));
        for ((range, flags), truth) in frame.range.as_slice().iter().zip(frame.flags.as_slice()).zip(truth) {
            if truth.is_nan() || range.is_nan() {
                continue;
            }
            let error = (f64::from(*range) - f64::from(truth)).abs();
            let is_sure = !flags.contains(Flags::UNWRAP_UNSURE);
            for (list, wrong) in errors.iter_mut().zip(&mut wrong).take(1 + usize::from(is_sure)) {
                list.push(error);
                *wrong += usize::from(error > 0.5 * interval_m);
            }
        }
        let pose = frame.pose.unwrap();
        if pose.state.has_pose() {
            let truth: Vec<f64> =
                truths.lines().nth(number).unwrap().split(' ').map(|word| word.parse().unwrap()).collect();
            let found = pose.world_from_camera.translation.vector;
            path.push([[found.x, found.y, found.z], [truth[3], truth[7], truth[11]]]);
        }
        lost += usize::from(!pose.state.has_pose());
    }
    let mut of_list = |index: usize| {
        let list = &mut errors[index];
        list.sort_unstable_by(f64::total_cmp);
        (1e3 * list[list.len() / 2], 100.0 * wrong[index] as f64 / list.len() as f64)
    };
    let ((median, share), (sure_median, sure_share)) = (of_list(0), of_list(1));
    println!("range {median} {share} {sure_median} {sure_share}\nlost {lost}");
    let line = |[found, truth]: &[[f64; 3]; 2]| {
        let numbers: Vec<String> = found.iter().chain(truth).map(ToString::to_string).collect();
        numbers.join(" ") + "\n"
    };
    std::fs::write(folder.join("positions.txt"), path.iter().map(line).collect::<String>()).unwrap();
}
