//! Whether the standard deviations of calibrations by planes are honest: many simulated surveys, and the errors of the
//! parameters compared with their covariances.
//!
//! Printed is the mean of `eᵀ C⁻¹ e` per unknown: 1 where the covariance is right.
//!
//! ```text
//! cargo run --release -p range-calibration --example range_terms_monte_carlo [runs]
//! ```
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../tests/support/mod.rs"]
mod support;

use range_calibration::PlaneCalibration;
use support::unknown_walls::{mean_over_surveys, with_planes_of_their_own, with_weighted_poses};

fn main() {
    let runs: u64 = std::env::args().nth(1).and_then(|runs| runs.parse().ok()).unwrap_or(200);
    println!("| planes, {runs} surveys | per unknown |\n|---|---|");
    for (name, calibrate) in
        [("weighted poses", with_weighted_poses as fn(u64) -> PlaneCalibration), ("no poses", with_planes_of_their_own)]
    {
        println!("| {name} | {:.3} |", mean_over_surveys(runs, calibrate));
    }
}
