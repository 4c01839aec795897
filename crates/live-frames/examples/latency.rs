//! How long frames take, one after the other without a pause, and whether memory stays the same.
//!
//! `RAYON_NUM_THREADS=1 cargo run --release -p live-frames --all-features --example latency [frames columns rows frequencies
//! tracking beside first anew]`, by default 10000 frames of 640 x 480 pixels at one frequency, without tracking. `tracking` 1: with poses and a map that is kept. `beside`
//! 1: each frame goes also through a processor that solves every frame by the full tree, in turn, so that what else the machine does slows both. A moving camera in a room
//! in which things move; 40 simulated frames are played forth and back, from the `first` one on, by default 0. `anew` 1: with other noise in each pass, as the same noise,
//! seen again and again, does not go down as poses state; that takes ten times as long. Times are those of the clock and those of the processor, over all threads.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // each user takes a part of it
mod common;
#[path = "../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;

use std::time::Instant;

use common::{INTERVAL_S, Sequence};
#[cfg(feature = "tracking")]
use live_frames::tracking::{nalgebra::Isometry3, rigid_pose::Uncertain};
use live_frames::{Limits, ProcessedFrame, Processor, Stages};

/// Frames that are simulated; they are played forth and back, so that motion has no jump.
const SIMULATED: usize = 40;

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let mut next = |default: usize| numbers.next().unwrap_or(default);
    let (frames, width, height, frequencies, tracking) = (next(10_000), next(640), next(480), next(1), next(0) > 0);
    let (beside, first, anew) = (next(0) > 0, next(0), next(0) > 0);
    let modulation_hz = if frequencies == 1 { vec![30e6] } else { vec![80e6, 60e6] };
    let sequence = Sequence { width, height, modulation_hz, rays: 1, first, ..Sequence::default() };
    let shown = |number: usize, pass: usize| {
        let frame = sequence.frame_with_noise(number, (1000 * (1 + pass) + number) as u64);
        (frame.raw, frame.truth.world_from_camera)
    };
    let mut simulated: Vec<_> = (0..SIMULATED).map(|number| shown(number, 0)).collect();
    let mut processor =
        Processor::new(&sequence.camera(), &sequence.calibration(), stages(tracking), Limits::default()).unwrap();
    let mut every = stages(false);
    every.unwrap.carry.refresh_frames = 1;
    let mut tree = Processor::new(&sequence.camera(), &sequence.calibration(), every, Limits::default()).unwrap();
    keep_map(&mut processor, tracking);
    let mut of_kinds = [Vec::new(), Vec::new()];
    let (mut milliseconds, mut of_tree) = (Vec::with_capacity(frames), Vec::new());
    let mut of_processor = Vec::with_capacity(frames);
    let mut quickest = vec![f64::INFINITY; 2 * SIMULATED - 2];
    let (mut whole, mut checks, mut failed, mut memory) = (0, 0, 0.0, [0; 2]);
    let (mut lost, mut errors) = (0, Vec::with_capacity(frames));
    for number in 0..frames {
        let at = number % (2 * SIMULATED - 2);
        if anew && at == 0 && number > 0 {
            simulated = (0..SIMULATED).map(|of_pass| shown(of_pass, number)).collect();
        }
        let (raw, truth) = &simulated[if at < SIMULATED { at } else { 2 * SIMULATED - 2 - at }];
        let samples = raw.samples();
        let (begin_ms, begin) = (processor_time_ms(), Instant::now());
        processor.process(samples, number as f64 * INTERVAL_S).unwrap();
        milliseconds.push(1e3 * begin.elapsed().as_secs_f64());
        of_processor.push(processor_time_ms() - begin_ms);
        quickest[at] = milliseconds.last().copied().unwrap_or(f64::NAN).min(quickest[at]);
        if beside {
            let begin = Instant::now();
            tree.process(samples, number as f64 * INTERVAL_S).unwrap();
            of_tree.push(1e3 * begin.elapsed().as_secs_f64());
        }
        let frame = processor.last();
        whole += usize::from(frame.counts.whole.is_some());
        of_kinds[usize::from(frame.counts.checked)].extend(of_processor.last());
        checks += usize::from(frame.counts.checked);
        failed += frame.counts.failed as f64 / frame.counts.used.max(1) as f64;
        lost += usize::from(is_lost(frame));
        errors.extend(pose_errors(frame, &(simulated[0].1.inverse() * truth)));
        if number == 100.min(frames - 1) {
            memory[0] = resident_kib();
        }
    }
    memory[1] = resident_kib();
    let count = frames as f64;
    println!(
        "{frames} frames of {width} x {height}, {frequencies} frequencies, {} threads, tracking {tracking}",
        rayon::current_num_threads()
    );
    println!(
        "whole trees {whole}, checked {:.1} % of the frames, pixels that failed {:.1} %, lost {lost}",
        100.0 * checks as f64 / count,
        100.0 * failed / count
    );
    println!("| ms | least | median | mean | 95 % | 99 % | largest |");
    println!("|---|---|---|---|---|---|---|");
    row("processor time", of_processor);
    row("by the clock", milliseconds);
    // What the machine's other guests slow is left out where a frame that comes again and again meets a quiet moment.
    row("by the clock, the quickest of each simulated frame", quickest);
    if frequencies == 1 {
        let [others, checked] = of_kinds;
        row("processor time of frames that a small image checks", checked);
        row("processor time of the others", others);
    }
    if beside {
        row("by the clock, full tree on every frame", of_tree);
    }
    tell_map(&processor);
    if !errors.is_empty() {
        let mean = |part: usize| errors.iter().map(|error| error[part]).sum::<f64>() / errors.len() as f64;
        let largest = errors.iter().map(|error| error[0]).fold(0.0, f64::max).sqrt();
        println!(
            "poses off by {:.1} mm (root mean square; largest {:.1}), squared error over covariance {:.1} (6 expected)",
            1e3 * mean(0).sqrt(),
            1e3 * largest,
            mean(1)
        );
    }
    println!(
        "resident at frame 100 and at the end: {:.1}, {:.1} MiB",
        memory[0] as f64 / 1024.0,
        memory[1] as f64 / 1024.0
    );
}

fn row(name: &str, mut milliseconds: Vec<f64>) {
    let count = milliseconds.len() as f64;
    let mean = milliseconds.iter().sum::<f64>() / count;
    milliseconds.sort_unstable_by(f64::total_cmp);
    let share = |share: f64| milliseconds.get(((count - 1.0) * share).round() as usize).copied().unwrap_or(f64::NAN);
    println!(
        "| {name} | {:.2} | {:.2} | {mean:.2} | {:.2} | {:.2} | {:.1} |",
        share(0.0),
        share(0.5),
        share(0.95),
        share(0.99),
        share(1.0)
    );
}

#[cfg(feature = "tracking")]
fn stages(tracking: bool) -> Stages {
    let tracking = tracking.then(live_frames::tracking::TrackerOptions::default);
    Stages { tracking, ..Stages::default() }
}

#[cfg(not(feature = "tracking"))]
fn stages(_: bool) -> Stages {
    Stages::default()
}

#[cfg(feature = "tracking")]
fn is_lost(frame: &ProcessedFrame) -> bool {
    frame.pose.is_some_and(|pose| !pose.state.has_pose())
}

#[cfg(not(feature = "tracking"))]
fn is_lost(_: &ProcessedFrame) -> bool {
    false
}

/// Squared distance of a frame's pose from the true one in the frame of the first, m², and the squared error over its covariance.
#[cfg(feature = "tracking")]
fn pose_errors(frame: &ProcessedFrame, truth: &Isometry3<f64>) -> Option<[f64; 2]> {
    let pose = frame.pose.filter(|pose| pose.state.has_pose() && frame.number > 0)?;
    let off = truth.inverse() * pose.world_from_camera;
    let found = Uncertain { pose: pose.world_from_camera, covariance: pose.covariance };
    Some([off.translation.vector.norm_squared(), found.mahalanobis_squared(&Uncertain::exact(*truth))?])
}

#[cfg(not(feature = "tracking"))]
fn pose_errors<T>(_: &ProcessedFrame, _: &T) -> Option<[f64; 2]> {
    None
}

/// Memory of this process, where the system tells; 0 elsewhere.
fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok()).unwrap_or(0)
}

/// Time that the threads of this program have run, which other programs on the machine lengthen less than the clock; 0 where the
/// system does not tell.
fn processor_time_ms() -> f64 {
    let of_thread = |folder: std::fs::DirEntry| {
        let text = std::fs::read_to_string(folder.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    // Threads that wait are counted up to now, this one after a sleep.
    cpu_clock::cpu_seconds();
    let Ok(threads) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    threads.filter_map(|folder| of_thread(folder.ok()?)).sum::<f64>() * 1e-6
}

#[cfg(feature = "tracking")]
fn keep_map(processor: &mut Processor, tracking: bool) {
    if tracking {
        processor
            .keep_map(live_frames::tracking::SurfaceMap::new(live_frames::tracking::MapOptions::default()).unwrap());
    }
}

#[cfg(not(feature = "tracking"))]
fn keep_map(_: &mut Processor, _: bool) {}

/// The map at the end, and how long it takes to bring it together.
#[cfg(feature = "tracking")]
fn tell_map(processor: &Processor) {
    let begin_ms = processor_time_ms();
    let Some(map) = processor.tracker().and_then(live_frames::tracking::Tracker::surface_map) else { return };
    println!("map of {} points in voxels of {} m, {:.0} ms", map.len(), map.voxel_m(), processor_time_ms() - begin_ms);
}

#[cfg(not(feature = "tracking"))]
fn tell_map(_: &Processor) {}
