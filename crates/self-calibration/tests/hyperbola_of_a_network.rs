//! The amplitude hyperbola of a network, without start values.

use crate::support::networks::{all_but_long_wave, deep, nominal};
use error_models::AmplitudeHyperbola;
use self_calibration::{CalibrationOptions, Network, SightingOptions, TermSelection, calibrate, simulate_sightings};

const TRUE: [f64; 3] = [1.1e-4, 0.0286, 156.0];

/// The deep network with targets dark, white and retro-reflective, as a camera observes it whose calibration is not known.
fn observed(hyperbola: Option<AmplitudeHyperbola>) -> Network {
    let mut truth = deep();
    truth.range_model.hyperbola = hyperbola;
    let options = SightingOptions {
        sigma_range_m: 0.008,
        amplitude_at_1_m: Some(4700.0),
        reflectance_span: [0.25, 6.0],
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

#[test]
fn auto_takes_a_hyperbola_where_there_is_one_and_only_there() {
    let taken = |hyperbola| {
        let outcome = calibrate(&observed(hyperbola), &CalibrationOptions::default()).unwrap();
        AmplitudeHyperbola::NAMES.map(|name| outcome.estimated.iter().any(|known| known == name))
    };
    assert_eq!(taken(Some(hyperbola())), [true; 3]);
    assert_eq!(taken(None), [false; 3]);
}
