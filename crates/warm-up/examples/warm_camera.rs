//! When a camera is warm: a simulated capture of five hours, its drift as estimated, and the verdict.
//!
//! `cargo run --release -p warm-up --example warm_camera`
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/drift_captures.rs"]
mod captures;

use captures::{Capture, transients};
use warm_up::{DriftOptions, estimate_drift};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let truth = transients(&[(0.008, 900.0)]);
    let drift = estimate_drift(&Capture::new(truth.clone()).samples(1), &DriftOptions::default())?;
    for (part, truth) in drift.model.transients.iter().zip(&truth.transients) {
        println!(
            "{:.2} mm after {:.0} s (true: {:.2} mm after {:.0} s)",
            1e3 * part.amplitude_m,
            part.time_constant_s,
            1e3 * truth.amplitude_m,
            truth.time_constant_s
        );
    }
    println!("{}", drift.verdict);
    Ok(())
}
