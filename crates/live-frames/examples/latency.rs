//! How long frames take, one after the other without a pause, and whether memory stays the same.
//!
//! `RAYON_NUM_THREADS=1 cargo run --release -p live-frames --all-features --example latency [frames columns rows frequencies
//! tracking beside]`, by default 10000 frames of 640 x 480 pixels at one frequency, without tracking. `beside` 1: each frame goes also through a processor that
//! solves every frame by the full tree, in turn, so that what else the machine does slows both. A moving camera in a room in
//! which things move; 40 simulated frames are played forth and back.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // each user takes a part of it
mod common;

use std::time::Instant;

use common::{INTERVAL_S, Sequence};
use live_frames::{Limits, Processor, Stages};

/// Frames that are simulated; they are played forth and back, so that motion has no jump.
const SIMULATED: usize = 40;

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let mut next = |default: usize| numbers.next().unwrap_or(default);
    let (frames, width, height, frequencies, tracking) = (next(10_000), next(640), next(480), next(1), next(0) > 0);
    let beside = next(0) > 0;
    let modulation_hz = if frequencies == 1 { vec![30e6] } else { vec![80e6, 60e6] };
    let sequence = Sequence { width, height, modulation_hz, rays: 1, ..Sequence::default() };
    let raw: Vec<_> = (0..SIMULATED).map(|number| sequence.frame(number).raw).collect();
    let mut processor =
        Processor::new(&sequence.camera(), &sequence.calibration(), stages(tracking), Limits::default()).unwrap();
    let mut every = stages(false);
    every.unwrap.carry.refresh_frames = 1;
    let mut tree = Processor::new(&sequence.camera(), &sequence.calibration(), every, Limits::default()).unwrap();
    let (mut milliseconds, mut of_tree) = (Vec::with_capacity(frames), Vec::new());
    let (mut whole, mut checks, mut failed, mut memory) = (0, 0, 0.0, [0; 2]);
    let mut lost = 0;
    let mut processor_ms = 0.0;
    for number in 0..frames {
        let at = number % (2 * SIMULATED - 2);
        let samples = raw[if at < SIMULATED { at } else { 2 * SIMULATED - 2 - at }].samples();
        let begin = Instant::now();
        processor.process(samples, number as f64 * INTERVAL_S).unwrap();
        milliseconds.push(1e3 * begin.elapsed().as_secs_f64());
        if beside {
            let begin = Instant::now();
            tree.process(samples, number as f64 * INTERVAL_S).unwrap();
            of_tree.push(1e3 * begin.elapsed().as_secs_f64());
        }
        let frame = processor.last();
        whole += usize::from(frame.counts.whole.is_some());
        checks += usize::from(frame.counts.checked);
        failed += frame.counts.failed as f64 / frame.counts.used.max(1) as f64;
        lost += usize::from(is_lost(frame));
        if number == 100.min(frames - 1) {
            memory[0] = resident_kib();
            processor_ms = processor_time_ms();
        }
    }
    let later = frames.saturating_sub(101).max(1) as f64;
    let processor_ms = (processor_time_ms() - processor_ms) / later;
    memory[1] = resident_kib();
    let count = frames as f64;
    println!(
        "{frames} frames of {width} x {height}, {frequencies} frequencies, {} threads, tracking {tracking}",
        rayon::current_num_threads()
    );
    println!(
        "whole trees {whole}, checked {:.1} % of the frames, pixels that failed {:.1} %, lost {lost}, processor time a frame \
         {processor_ms:.2} ms",
        100.0 * checks as f64 / count,
        100.0 * failed / count
    );
    println!("| ms | least | median | mean | 95 % | 99 % | largest |");
    println!("|---|---|---|---|---|---|---|");
    row("carried counts", milliseconds);
    if beside {
        row("full tree on every frame", of_tree);
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
    let share = |share: f64| milliseconds[((count - 1.0) * share).round() as usize];
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
fn is_lost(frame: &live_frames::ProcessedFrame) -> bool {
    frame.pose.is_some_and(|pose| !pose.state.has_pose())
}

#[cfg(not(feature = "tracking"))]
fn is_lost(_: &live_frames::ProcessedFrame) -> bool {
    false
}

/// Memory of this process, where the system tells; 0 elsewhere.
fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok()).unwrap_or(0)
}

/// Time that this thread has run, which other programs on the machine lengthen less than the clock; 0 where the system does not
/// tell.
fn processor_time_ms() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split_whitespace().next().and_then(|nanoseconds| nanoseconds.parse::<f64>().ok()).unwrap_or(0.0) * 1e-6
}
