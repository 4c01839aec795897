//! One adjustment of a simulated network: parameters with their deviations, and the weakest combination.
//!
//! `cargo run --release -p calibration-network --example one_adjustment`
#![allow(clippy::print_stdout, clippy::unwrap_used, dead_code)]

#[path = "../tests/support/mod.rs"]
mod support;

use calibration_network::functional_model::{Datum, Setup};
use calibration_network::{SightingOptions, simulate_sightings};
use support::{nominal, strong, terms};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut observed = simulate_sightings(&strong(), &SightingOptions::default())?;
    nominal(&mut observed);
    let ranged = vec![true; observed.stations.len()];
    let names = terms("xp yp c k1 k2 d0 d4 d5 d6 d7 e1 e2");
    let setup = Setup::from_network(&observed, names, ranged, false, Datum::Inner)?;
    let solved = setup.solve()?;
    let estimate = setup.estimate_of_terms(&solved)?;
    for (index, name) in estimate.names.iter().enumerate() {
        println!("{name:>3}: deviation {:.2e}", estimate.covariance[(index, index)].sqrt());
    }
    println!("sigma0 {:.3}", solved.solution.sigma0().unwrap_or(f64::NAN));
    if let Some(strength) = setup.strength(&solved)? {
        println!("{}", strength.sentence());
    }
    Ok(())
}
