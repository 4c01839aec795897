//! A camera's thread calls a slot for every frame; another thread takes the newest and works on it.
//!
//! `cargo run --release -p live-frames --example camera_callback [frames hertz columns rows]`, by default 90 frames at 30 Hz of
//! 320 x 240 pixels. Frames that come while one is worked on are dropped whole, never queued.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
#[allow(dead_code)] // each user takes a part of it
mod common;

use std::time::{Duration, Instant};

use common::Sequence;
use live_frames::range_image::{RawFrame, Samples};
use live_frames::{Limits, Processor, Stages, latest_frame};

/// What the camera's thread hands over.
struct Taken {
    timestamp_s: f64,
    at: Instant,
    samples: Samples,
}

fn main() {
    let mut numbers = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let mut next = |default: usize| numbers.next().unwrap_or(default);
    let (frames, hertz, width, height) = (next(90), next(30), next(320), next(240));
    let sequence = Sequence { width, height, rays: 1, ..Sequence::default() };
    let shown: Vec<RawFrame> = (0..20).map(|number| sequence.frame(number).raw).collect();
    let mut processor =
        Processor::new(&sequence.camera(), &sequence.calibration(), Stages::default(), Limits::default()).unwrap();

    let (mut writer, reader) = latest_frame();
    let camera = std::thread::spawn(move || {
        for number in 0..frames {
            let at = number % (2 * shown.len() - 2);
            let samples = shown[at.min(2 * shown.len() - 2 - at)].samples().clone();
            let timestamp_s = number as f64 / hertz as f64;
            // A driver's callback is no more than this line.
            drop(writer.write(Taken { timestamp_s, at: Instant::now(), samples }));
            std::thread::sleep(Duration::from_secs_f64(1.0 / hertz as f64));
        }
    });

    let mut milliseconds = Vec::new();
    while let Some(taken) = reader.read() {
        let frame = processor.process(&taken.samples, taken.timestamp_s).unwrap();
        milliseconds.push(1e3 * taken.at.elapsed().as_secs_f64());
        if frame.number.is_multiple_of(30) {
            let centre = frame.points[frame.width() * frame.height() / 2 + frame.width() / 2];
            println!("{:6.2} s: centre at {centre:.3?} m, counts {:?}", frame.timestamp_s, frame.counts);
        }
    }
    camera.join().unwrap();
    let done = milliseconds.len();
    milliseconds.sort_unstable_by(f64::total_cmp);
    let share = |share: f64| milliseconds[((done - 1) as f64 * share).round() as usize];
    println!(
        "{done} frames, {} dropped, from callback to points: p50 {:.2} ms, p99 {:.2} ms",
        reader.dropped(),
        share(0.5),
        share(0.99)
    );
}
