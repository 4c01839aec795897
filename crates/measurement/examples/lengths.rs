//! Simulated surveys, measured: whether 95 % intervals hold the truth in 95 of 100 surveys, with and without the covariance of
//! calibration.
//!
//! `cargo run --release -p measurement --example lengths [SURVEYS]`

#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/scene/mod.rs"]
mod scene;
#[path = "../tests/statistics/mod.rs"]
mod statistics;

fn main() {
    let surveys = std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(200);
    println!(
        "{surveys} surveys: share of 95 % intervals with the truth in them, normalised squared error (1 expected),"
    );
    println!("error and stated sigma (root mean square)\n");
    println!(
        "{:24} {:>9} {:>6} {:>11} {:>11} {:>22} {:>6}",
        "quantity", "inside, %", "NSE", "error", "sigma", "without calibration, %", "NSE"
    );
    for (name, tally) in statistics::run(surveys, 1) {
        println!(
            "{name:24} {:9.1} {:6.2} {:11.6} {:11.6} {:22.1} {:6.2}",
            100.0 * tally.inside(),
            tally.nse(),
            tally.error(),
            tally.sigma(),
            100.0 * tally.inside_without(),
            tally.nse_without(),
        );
    }
}
