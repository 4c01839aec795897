//! Score tests of terms that are not estimated.

use crate::support::networks::{all_but_long_wave, nominal, normal};
use self_calibration::{CalibrationOptions, SightingOptions, TermSelection, calibrate, simulate_sightings};

/// Derivatives at measured image points carry their noise, which is that of the residuals: what terms that a camera does
/// not have then seem to bring grows with noise and number of values. Half a pixel among thousands of values is as
/// telling as a twentieth among hundreds of thousands.
#[test]
fn noise_of_image_points_shows_no_terms() {
    for seed in 0..6 {
        let options = SightingOptions { sigma_pixel: 0.5, seed, ..SightingOptions::default() };
        let mut network = simulate_sightings(&normal(), &options).unwrap();
        nominal(&mut network);
        let terms = all_but_long_wave().into_iter().filter(|name| name != "k3").collect();
        let outcome = calibrate(
            &network,
            &CalibrationOptions { terms: TermSelection::List(terms), ..CalibrationOptions::default() },
        )
        .unwrap();
        assert!(outcome.unestimated.len() >= 2, "{:?}", outcome.unestimated);
        for score in &outcome.unestimated {
            println!("{seed}: {:?} {:.2} p = {:.2e}", score.terms, score.statistic, score.p);
            assert!(score.p > 1e-3, "{seed}: {:?} at p = {:.1e}", score.terms, score.p);
        }
    }
}
