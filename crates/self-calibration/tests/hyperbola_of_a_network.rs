//! The amplitude hyperbola of a network, without start values.

use std::collections::BTreeMap;

use crate::support::networks::{all_but_long_wave, deep, nominal};
use error_models::{AmplitudeHyperbola, RangeTerms};
use nalgebra::DVector;
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Network, SightingOptions, TermSelection, calibrate, simulate_sightings,
};

const TRUE: [f64; 3] = [1.1e-4, 0.0286, 156.0];

/// The deep network with targets dark, white and retro-reflective, as a camera observes it whose calibration is not known.
fn observed(hyperbola: Option<AmplitudeHyperbola>) -> Network {
    observed_with(hyperbola, 1)
}

fn observed_with(hyperbola: Option<AmplitudeHyperbola>, seed: u64) -> Network {
    let mut truth = deep();
    truth.range_model.hyperbola = hyperbola;
    let options = SightingOptions {
        sigma_range_m: 0.008,
        amplitude_at_1_m: Some(4700.0),
        reflectance_span: [0.25, 6.0],
        seed,
        ..SightingOptions::default()
    };
    let mut observed = simulate_sightings(&truth, &options).unwrap();
    nominal(&mut observed);
    observed.range_model.hyperbola = None;
    observed
}

fn hyperbola() -> AmplitudeHyperbola {
    let [h1, h2, h3] = TRUE;
    AmplitudeHyperbola { h1, h2, h3, amplitude_span: [15.0, 90_000.0] }
}

#[test]
fn a_listed_hyperbola_finds_its_start() {
    let mut names = all_but_long_wave();
    names.extend(AmplitudeHyperbola::NAMES.map(str::to_owned));
    let options = CalibrationOptions { terms: TermSelection::List(names), ..CalibrationOptions::default() };
    let outcome = calibrate(&observed(Some(hyperbola())), &options).unwrap();
    let d = [("d0", 0.024), ("d6", -0.009), ("d7", 0.004)];
    for (name, value) in AmplitudeHyperbola::NAMES.into_iter().zip(TRUE).chain(d) {
        let found = outcome.parameter(name).unwrap();
        let error = found.value - value;
        assert!(
            error.abs() < 4.0 * found.sigma_prior,
            "{name}: {} is off by {error} of {}",
            found.value,
            found.sigma_prior
        );
    }
    // The residuals are those of the noise: sigma0 is 1 within four of its deviations, 1 / √(2 · 1500).
    assert!((outcome.sigma0.unwrap() - 1.0).abs() < 0.075, "{:?}", outcome.sigma0);
    let span = outcome.range_models[0].1.hyperbola.unwrap().amplitude_span;
    assert!(span[0] > 15.0 && span[1] < 90_000.0, "{span:?}");
}

/// Where h3 is known to a third, its confidence region is bent: an ellipsoid in h1, h2, h3 at the estimate alone would be
/// missed by the truth by up to forty times its variance.
#[test]
fn the_truth_lies_within_the_ellipsoid_of_a_hyperbola() {
    let mut names = all_but_long_wave();
    names.extend(["d2", "d3"].into_iter().chain(AmplitudeHyperbola::NAMES).map(str::to_owned));
    let options = CalibrationOptions { terms: TermSelection::List(names), ..CalibrationOptions::default() };
    let mut truth = deep();
    truth.range_model.hyperbola = Some(hyperbola());
    let mut sum = 0.0;
    let seeds = [1, 3, 5, 7, 9, 11];
    for seed in seeds {
        let outcome = calibrate(&observed_with(Some(hyperbola()), seed), &options).unwrap();
        assert!(outcome.doubts.is_empty(), "{:?}", outcome.doubts);
        let per_unknown = misfit(&outcome, &truth) / outcome.estimated.len() as f64;
        // Chi-squared of 20 exceeds 3.1 for each of them once in a million.
        assert!(per_unknown < 3.1, "seed {seed}: {per_unknown}");
        sum += per_unknown;
    }
    // Of 120 together: 1 with a deviation of 0.13.
    let mean = sum / seeds.len() as f64;
    assert!((0.55..1.5).contains(&mean), "{mean}");
}

/// Squared errors of the estimated parameters in their covariance.
fn misfit(outcome: &CalibrationOutcome, truth: &Network) -> f64 {
    let [xp, yp] = truth.camera.interior.principal_point_mm;
    let lens = truth.camera.lens;
    let camera = [("xp", xp), ("yp", yp), ("c", truth.camera.interior.principal_distance_mm), ("k1", lens.k1)];
    let camera = camera.into_iter().chain([("k2", lens.k2), ("k3", lens.k3), ("p1", lens.p1), ("p2", lens.p2)]);
    let terms = RangeTerms::NAMES.into_iter().zip(truth.range_model.terms.to_array());
    let known: BTreeMap<&str, f64> =
        camera.chain(terms).chain(AmplitudeHyperbola::NAMES.into_iter().zip(TRUE)).collect();
    let error = |name: &String| outcome.parameter(name).unwrap().value - known[name.as_str()];
    let errors = DVector::from_iterator(outcome.estimated.len(), outcome.estimated.iter().map(error));
    errors.dot(&outcome.covariance.clone().cholesky().unwrap().solve(&errors))
}

#[test]
fn auto_takes_a_hyperbola_where_there_is_one_and_only_there() {
    let taken = |hyperbola| {
        let outcome = calibrate(&observed(hyperbola), &CalibrationOptions::default()).unwrap();
        AmplitudeHyperbola::NAMES.map(|name| outcome.estimated.iter().any(|known| known == name))
    };
    assert_eq!(taken(Some(hyperbola())), [true; 3]);
    assert_eq!(taken(None), [false; 3]);
}
