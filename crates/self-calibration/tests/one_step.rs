//! The one-step method.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use self_calibration::{
    CalibrationOptions, Method, SightingOptions, SimulatedStart, TermSelection, calibrate, simulate_sightings,
};
use support::networks::{all_but_long_wave, nominal, normal, small};

fn options() -> CalibrationOptions {
    CalibrationOptions {
        method: Method::OneStep,
        terms: TermSelection::List(all_but_long_wave()),
        ..CalibrationOptions::default()
    }
}

#[test]
fn without_noise_the_truth_comes_back() {
    let truth = small();
    let quiet = SightingOptions { sigma_pixel: 1e-5, sigma_range_m: 1e-6, ..SightingOptions::default() };
    for start in [SimulatedStart::Disturbed { position_m: 0.02, attitude_rad: 0.01 }, SimulatedStart::Absent] {
        let mut observed = simulate_sightings(&truth, &SightingOptions { start, ..quiet.clone() }).unwrap();
        nominal(&mut observed);
        let outcome = calibrate(&observed, &options()).unwrap();
        // Noise of 1e-5 pixel and 1e-6 m, enlarged by correlations.
        let c = outcome.camera.interior.principal_distance_mm;
        assert!((c - truth.camera.interior.principal_distance_mm).abs() < 1e-4, "{c}");
        let [found, true_terms] = [&outcome.range_models[0].1, &truth.range_model].map(|m| m.terms.to_array());
        for (found, truth) in found.iter().zip(true_terms) {
            assert!((found - truth).abs() < 1e-5, "{found} {truth}");
        }
        assert_eq!(outcome.datum_defect, 6);
    }
}

#[test]
fn the_normal_network_is_solved() {
    let mut observed = simulate_sightings(&normal(), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let outcome = calibrate(&observed, &options()).unwrap();
    for p in &outcome.parameters {
        println!("{} {} +- {} p={}", p.name, p.value, p.sigma_prior, p.significance_p);
    }
    println!("{} {} {:?} it {}", outcome.observations, outcome.unknowns, outcome.sigma0, outcome.trace.len());
}
