//! Range terms estimated from synthetic differences: truth, covariance, refusals.

use crate::support::{INTERVAL, model, terms, track, walls};
use approx::assert_relative_eq;
use error_models::{AmplitudeHyperbola, ParameterStatus, RangeTerms};
use nalgebra::DVector;
use range_calibration::{Error, HyperbolaUse, RangeTermOptions, Scale, TermUse, estimate_range_terms};

const SIGMA: f64 = 0.005;

fn hyperbola() -> AmplitudeHyperbola {
    AmplitudeHyperbola { h1: 0.002, h2: 0.05, h3: 25.0, amplitude_span: [0.0, 1e5] }
}

#[test]
fn the_terms_are_recovered_within_four_standard_deviations() {
    for seed in 0..5 {
        let differences = walls(&model(None), &track(), SIGMA, seed);
        let calibration = estimate_range_terms(&differences, INTERVAL, &RangeTermOptions::default()).unwrap();
        let parameters = calibration.parameters(Scale::Prior).unwrap();
        for (parameter, truth) in parameters.iter().zip(terms().to_array()) {
            assert_eq!(parameter.status, ParameterStatus::Estimated);
            let error = parameter.value - truth;
            assert!(error.abs() < 4.0 * parameter.sigma, "{parameter:?}, truth {truth}, seed {seed}");
        }
        // 3840 differences: sigma0 is known to 1 / sqrt(2 * 3831) = 1.2 %; four times that.
        assert_relative_eq!(calibration.sigma0().unwrap(), 1.0, epsilon = 0.05);
        assert_eq!(calibration.redundancy(), differences.len() as i64 - 9);
        assert!(calibration.rms_after_m() < 1.05 * SIGMA && calibration.rms_before_m() > 0.02);
        assert_eq!(calibration.residuals_m().len(), differences.len());
    }
}

#[test]
fn the_covariance_is_that_of_repeated_calibrations() {
    let distances = [0.8, 1.6, 2.4, 3.2, 4.0, 4.8];
    let truth = DVector::from_column_slice(&terms().to_array());
    let runs = 300;
    let (mut chi_squared, mut squares, mut sigma) = (0.0, DVector::zeros(9), DVector::zeros(9));
    for seed in 0..runs {
        let differences = walls(&model(None), &distances, SIGMA, 1000 + seed);
        let calibration = estimate_range_terms(&differences, INTERVAL, &RangeTermOptions::default()).unwrap();
        let covariance = calibration.covariance(Scale::Prior).unwrap();
        let error = DVector::from_column_slice(&calibration.model().terms.to_array()) - &truth;
        chi_squared += error.dot(&covariance.clone().cholesky().unwrap().solve(&error)) / runs as f64;
        squares += error.component_mul(&error) / runs as f64;
        sigma = covariance.diagonal();
    }
    // The mean of 300 chi-squared numbers of 9 degrees of freedom scatters by sqrt(18 / 300) = 0.24; four times that.
    assert_relative_eq!(chi_squared, 9.0, epsilon = 1.0);
    for (sampled, predicted) in squares.iter().zip(sigma.iter()) {
        // A variance from 300 runs is known to sqrt(2 / 300) = 8 %; four times that.
        assert_relative_eq!(sampled / predicted, 1.0, epsilon = 0.33);
    }
}

#[test]
fn posterior_deviations_do_not_depend_on_the_sigma_given() {
    let differences = walls(&model(None), &track(), SIGMA, 3);
    let doubled: Vec<_> =
        differences.iter().map(|d| range_calibration::RangeDifference { sigma_m: 0.01, ..*d }).collect();
    let estimate = |d: &[_]| estimate_range_terms(d, INTERVAL, &RangeTermOptions::default()).unwrap();
    let (told, doubled) = (estimate(&differences), estimate(&doubled));
    let sigma = |c: &range_calibration::RangeCalibration, scale| c.parameters(scale).unwrap()[0].sigma;
    assert_relative_eq!(2.0 * sigma(&told, Scale::Prior), sigma(&doubled, Scale::Prior), max_relative = 1e-9);
    assert_relative_eq!(sigma(&told, Scale::Posterior), sigma(&doubled, Scale::Posterior), max_relative = 1e-9);
    assert_relative_eq!(told.sigma0().unwrap(), 2.0 * doubled.sigma0().unwrap(), max_relative = 1e-9);
}

#[test]
fn one_distance_is_refused_and_says_what_it_cannot_separate() {
    for distances in [vec![3.0], vec![2.0, 2.1, 2.2]] {
        let differences = walls(&model(None), &distances, SIGMA, 1);
        let answer = estimate_range_terms(&differences, INTERVAL, &RangeTermOptions::default());
        let Err(Error::NotDetermined { combination, inflation, range_span_m }) = answer else { panic!("{answer:?}") };
        assert!(combination.contains("d0") && combination.contains("d2"), "{combination}");
        assert!(inflation > 100.0);
        assert!(range_span_m[0] > 1.9 && range_span_m[1] < 3.5);
    }
    // With the periodic terms held, one distance is enough for the offset and the delay.
    let differences = walls(&model(None), &[3.0], SIGMA, 1);
    let mut options = RangeTermOptions::default().hold_terms(&terms());
    for index in [0, 7, 8] {
        options.terms[index] = TermUse::Estimate;
    }
    let calibration = estimate_range_terms(&differences, INTERVAL, &options).unwrap();
    assert_eq!(calibration.estimated_names(), ["d0", "e1", "e2"]);
    assert_eq!(calibration.estimated_units(), ["m", "m/mm", "m/mm"]);
    let parameters = calibration.parameters(Scale::Prior).unwrap();
    assert_relative_eq!(parameters[0].value, 0.024, epsilon = 4.0 * parameters[0].sigma);
    assert_eq!(parameters[1].status, ParameterStatus::Held);
    assert_relative_eq!(parameters[1].value, terms().periodic[0]);
}

#[test]
fn a_pair_that_nothing_determines_is_named() {
    // Ranges a quarter of U apart: the pair of wavelength U/4 is a constant there, whatever its phase.
    let mut differences = walls(&model(None), &[1.0], SIGMA, 1);
    for (index, difference) in differences.iter_mut().enumerate() {
        difference.observed_range_m = 1.0 + 0.25 * INTERVAL * (index % 4) as f64;
    }
    let answer = estimate_range_terms(&differences, INTERVAL, &RangeTermOptions::default());
    let Err(Error::NotDetermined { combination, inflation, .. }) = answer else { panic!("{answer:?}") };
    assert!(inflation.is_infinite());
    assert!(combination.contains("d6") && combination.contains("d0"), "{combination}");
}

#[test]
fn the_hyperbola_is_recovered_from_what_the_terms_leave_over() {
    for seed in 0..3 {
        let differences = walls(&model(Some(hyperbola())), &track(), SIGMA, seed);
        let options = RangeTermOptions::default().hold_terms(&terms()).with_hyperbola();
        let calibration = estimate_range_terms(&differences, INTERVAL, &options).unwrap();
        let parameters = calibration.parameters(Scale::Prior).unwrap();
        let truth = hyperbola();
        for (parameter, truth) in parameters[9..].iter().zip([truth.h1, truth.h2, truth.h3]) {
            assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{parameter:?}, truth {truth}");
        }
        assert_relative_eq!(calibration.sigma0().unwrap(), 1.0, epsilon = 0.05);
        let span = calibration.model().hyperbola.unwrap().amplitude_span;
        assert!(differences.iter().all(|d| (span[0]..=span[1]).contains(&d.amplitude)));
    }
}

#[test]
fn terms_and_hyperbola_are_recovered_together() {
    let differences = walls(&model(Some(hyperbola())), &track(), SIGMA, 5);
    let calibration =
        estimate_range_terms(&differences, INTERVAL, &RangeTermOptions::default().with_hyperbola()).unwrap();
    let h = hyperbola();
    let truth = terms().to_array().into_iter().chain([h.h1, h.h2, h.h3]);
    for (parameter, truth) in calibration.parameters(Scale::Prior).unwrap().iter().zip(truth) {
        assert!((parameter.value - truth).abs() < 4.0 * parameter.sigma, "{parameter:?}, truth {truth}");
    }
    // The offset and the level of the hyperbola at large amplitudes share their effect, and that is said.
    let pair = &calibration.diagnosis(0.9).correlated[0];
    assert_eq!([pair.0.as_str(), pair.1.as_str()], ["d0", "h1"]);
}

#[test]
fn the_covariance_of_the_hyperbola_is_that_of_repeated_calibrations() {
    let options = RangeTermOptions::default().hold_terms(&terms()).with_hyperbola();
    let (runs, truth) = (100, DVector::from_column_slice(&[0.002, 0.05, 25.0]));
    let mut chi_squared = 0.0;
    for seed in 0..runs {
        let differences = walls(&model(Some(hyperbola())), &[0.8, 2.0, 3.2, 4.4], SIGMA, 5000 + seed);
        let calibration = estimate_range_terms(&differences, INTERVAL, &options).unwrap();
        let estimated = calibration.model().hyperbola.unwrap();
        let error = DVector::from_column_slice(&[estimated.h1, estimated.h2, estimated.h3]) - &truth;
        let covariance = calibration.covariance(Scale::Prior).unwrap();
        chi_squared += error.dot(&covariance.cholesky().unwrap().solve(&error)) / runs as f64;
    }
    // The mean of 100 chi-squared numbers of 3 degrees of freedom scatters by sqrt(6 / 100) = 0.24; four times that.
    assert_relative_eq!(chi_squared, 3.0, epsilon = 1.0);
}

#[test]
fn a_held_hyperbola_is_taken_off_first() {
    let differences = walls(&model(Some(hyperbola())), &track(), SIGMA, 5);
    let options = RangeTermOptions { hyperbola: HyperbolaUse::Hold(hyperbola()), ..RangeTermOptions::default() };
    let calibration = estimate_range_terms(&differences, INTERVAL, &options).unwrap();
    let parameters = calibration.parameters(Scale::Prior).unwrap();
    assert_relative_eq!(parameters[0].value, 0.024, epsilon = 4.0 * parameters[0].sigma);
    assert_eq!((parameters[10].status, parameters[10].sigma.to_bits()), (ParameterStatus::Held, 0));
    assert_eq!(calibration.model().hyperbola, Some(hyperbola()));
}

#[test]
fn bad_input_is_refused_by_name() {
    let good = walls(&model(None), &track(), SIGMA, 1);
    let estimate = |d: &[_], o: &RangeTermOptions| estimate_range_terms(d, INTERVAL, o).map(|_| ()).unwrap_err();
    let default = RangeTermOptions::default();
    assert_eq!(estimate(&[], &default), Error::TooFewDifferences { differences: 0, unknowns: 9 });
    assert_eq!(estimate(&good[..9], &default), Error::TooFewDifferences { differences: 9, unknowns: 9 });
    assert_eq!(estimate(&good, &default.hold_terms(&terms())), Error::NothingToEstimate);
    for interval in [0.0, f64::NAN] {
        assert!(matches!(estimate_range_terms(&good, interval, &default), Err(Error::OutOfDomain { .. })));
    }
    let mut bad = good.clone();
    bad[17].sigma_m = 0.0;
    assert!(matches!(estimate(&bad, &default), Error::BadDifference { index: 17, name: "sigma_m", .. }));
    bad[16].observed_range_m = f64::NAN;
    assert!(matches!(estimate(&bad, &default), Error::BadDifference { index: 16, name: "observed_range_m", .. }));
    let mut dark = good.clone();
    dark[3].amplitude = f64::NAN;
    assert!(estimate_range_terms(&dark, INTERVAL, &default).is_ok());
    let amplitude = |answer| matches!(answer, Error::BadDifference { index: 3, name: "amplitude", .. });
    assert!(amplitude(estimate(&dark, &default.with_hyperbola())));
    let narrow = AmplitudeHyperbola { amplitude_span: [1.0, 2.0], ..hyperbola() };
    let held = RangeTermOptions { hyperbola: HyperbolaUse::Hold(narrow), ..default };
    assert!(matches!(estimate(&good, &held), Error::BadDifference { name: "amplitude", .. }));
    let even: Vec<_> = good.iter().map(|d| range_calibration::RangeDifference { amplitude: 50.0, ..*d }).collect();
    assert!(matches!(estimate(&even, &default.with_hyperbola()), Error::NoHyperbola { .. }));
    assert!(matches!(default.hold("d1", 0.0), Err(Error::Model(error_models::Error::UnknownParameter { .. }))));
    let nan = RangeTerms { d0: f64::NAN, ..terms() };
    assert!(matches!(estimate(&good, &default.hold_terms(&nan)), Error::Model(_)));
    let limit = RangeTermOptions { largest_inflation: 0.5, ..default };
    assert!(matches!(estimate(&good, &limit), Error::OutOfDomain { name: "largest_inflation", .. }));
}
