//! What each stage of a frame costs, from samples to corrected points, on one thread.
//!
//! `cargo run --release -p rangecam --example frame_budget [columns rows]`. Each figure is the least of many runs.
#![allow(clippy::print_stdout)]

#[path = "../benches/stages/mod.rs"]
mod stages;

use std::time::Instant;

use stages::{Failure, Frame, Unwrapping};

const RUNS: usize = 40;

fn main() -> Result<(), Failure> {
    let mut sizes = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let (width, height) = (sizes.next().unwrap_or(640), sizes.next().unwrap_or(480));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    println!("{width} x {height} pixels, 4 samples a frequency, 1 thread, milliseconds\n");
    let stages: Vec<&str> = Frame::STAGES.iter().map(|(name, _)| *name).collect();
    println!("| ms | sum | {} | ranges right to 0.3 m |", stages.join(" | "));
    println!("|{}", "---|".repeat(stages.len() + 3));
    pool.install(|| Unwrapping::ALL.iter().try_for_each(|(unwrapping, name)| report(width, height, *unwrapping, name)))
}

fn report(width: usize, height: usize, unwrapping: Unwrapping, name: &str) -> Result<(), Failure> {
    let mut frame = Frame::new(width, height, unwrapping)?;
    frame.run()?;
    let mut least = [f64::INFINITY; Frame::STAGES.len()];
    for _ in 0..RUNS {
        for ((_, stage), least) in Frame::STAGES.iter().zip(&mut least) {
            let start = Instant::now();
            stage(&mut frame)?;
            *least = least.min(1e3 * start.elapsed().as_secs_f64());
        }
    }
    let sum: f64 = least.iter().sum();
    let each = least.map(|milliseconds| format!("{milliseconds:.2}")).join(" | ");
    println!("| {name} | {sum:.1} | {each} | {:.1} % |", 100.0 * frame.right());
    Ok(())
}
