//! Whether the standard deviations are honest: many simulated surveys calibrated by each method, and the errors of the
//! parameters compared with their covariances.
//!
//! Printed is the mean of `eᵀ C⁻¹ e` per unknown, and of `(e / σ)²` for each parameter: 1 where the covariance is right.
//!
//! ```text
//! cargo run --release -p self-calibration --example monte_carlo [runs]
//! ```
#![allow(clippy::print_stdout, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../tests/support/mod.rs"]
mod support;

use self_calibration::{CalibrationOptions, SightingOptions, TermSelection};
use support::cases::{calibrated, cases, errors};
use support::networks::all_but_long_wave;

fn main() {
    let runs: u64 = std::env::args().nth(1).and_then(|runs| runs.parse().ok()).unwrap_or(200);
    let options = CalibrationOptions {
        terms: TermSelection::List(all_but_long_wave()),
        rejection_level: None,
        ..CalibrationOptions::default()
    };
    println!("| method, {runs} surveys | per unknown | each |\n|---|---|---|");
    for case in cases() {
        let (mut sum, mut names, mut squares) = (0.0, Vec::new(), Vec::new());
        for seed in 0..runs {
            let outcome = calibrated(&case, &SightingOptions { seed, ..SightingOptions::default() }, &options);
            let errors = errors(&case, &outcome);
            sum += errors.dot(&outcome.covariance.clone().cholesky().unwrap().solve(&errors));
            squares.resize(errors.len(), 0.0);
            for (i, square) in squares.iter_mut().enumerate() {
                *square += errors[i] * errors[i] / outcome.covariance[(i, i)];
            }
            names = outcome.estimated;
        }
        let mean = |sum: f64| sum / runs as f64;
        let each: Vec<String> =
            names.iter().zip(&squares).map(|(name, sum)| format!("{name} {:.2}", mean(*sum))).collect();
        println!("| {} | {:.3} | {} |", case.name, mean(sum) / names.len() as f64, each.join(", "));
    }
}
