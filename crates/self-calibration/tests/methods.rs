//! All methods: the truth without noise, and honest deviations with it.

use crate::support::cases::{calibrated, cases, errors};
use crate::support::networks::{all_but_long_wave, nominal, small, with_control};
use error_models::{PeriodicSpline, RangeTerms};
use self_calibration::{
    CalibrationOptions, Method, NetworkDatum, SightingOptions, SimulatedStart, TermSelection, calibrate,
    simulate_sightings,
};

fn options() -> CalibrationOptions {
    CalibrationOptions {
        terms: TermSelection::List(all_but_long_wave()),
        rejection_level: None,
        ..CalibrationOptions::default()
    }
}

#[test]
fn without_noise_every_method_finds_the_truth() {
    for case in cases() {
        // A thousandth of the usual noise, and control without any to speak of.
        let quiet =
            SightingOptions { sigma_pixel: 5e-5, sigma_range_m: 1e-5, sigma_passive_pixel: 2e-4, ..Default::default() };
        let start = SimulatedStart::Absent;
        let mut case = case;
        case.truth.targets.iter_mut().filter_map(|t| t.covariance.as_mut()).for_each(|c| *c *= 1e-6);
        case.truth.distances.iter_mut().for_each(|known| known.sigma_m *= 1e-3);
        if let Some(passive) = case.truth.passive.as_mut() {
            passive.covariance = passive.covariance.map(|c| c * 1e-6);
        }
        case.lens.iter_mut().flat_map(|lens| &mut lens.distances).for_each(|known| known.sigma_m *= 1e-3);
        let outcome = calibrated(&case, &SightingOptions { start, ..quiet }, &options());
        let errors = errors(&case, &outcome);
        for (i, name) in outcome.estimated.iter().enumerate() {
            let sigma = outcome.covariance[(i, i)].sqrt();
            // Five deviations of a thousandth of the usual noise: a hundred parameters are looked at.
            assert!(errors[i].abs() < 5.0 * sigma, "{}: {name} is off by {} of {sigma}", case.name, errors[i]);
        }
    }
}

#[test]
fn deviations_are_honest() {
    let runs = 8;
    for case in cases() {
        let (mut sum, mut unknowns) = (0.0, 0);
        for seed in 0..runs {
            let sightings = SightingOptions { seed, ..SightingOptions::default() };
            let outcome = calibrated(&case, &sightings, &options());
            let errors = errors(&case, &outcome);
            let weighted = outcome.covariance.clone().cholesky().unwrap().solve(&errors);
            sum += errors.dot(&weighted);
            unknowns += errors.len();
        }
        let ratio = sum / unknowns as f64;
        // Four standard deviations of chi-squared over its degrees of freedom. 200 runs are in `examples/monte_carlo.rs`.
        let allowed = 4.0 * (2.0 / unknowns as f64).sqrt();
        assert!((ratio - 1.0).abs() < allowed, "{}: chi-squared per unknown {ratio:.3}", case.name);
    }
}

#[test]
fn two_steps_with_the_full_covariance_agree_with_one() {
    let mut observed = simulate_sightings(&with_control(small()), &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    let of = |method| {
        calibrate(&observed, &CalibrationOptions { method, datum: NetworkDatum::Control, ..options() }).unwrap()
    };
    let (one, two) = (of(Method::OneStep), of(Method::TwoStepDependent));
    for name in ["d0", "d4", "d7", "e1"] {
        let [a, b] = [&one, &two].map(|outcome| outcome.parameter(name).unwrap());
        // To first order the two are the same; the linearisation of the reference makes up the rest.
        assert!((a.value - b.value).abs() < 0.05 * a.sigma_prior, "{name}: {} {}", a.value, b.value);
        assert!((a.sigma_prior / b.sigma_prior - 1.0).abs() < 0.02, "{name}: {} {}", a.sigma_prior, b.sigma_prior);
    }
    assert_eq!(one.redundancy, two.redundancy);
}

#[test]
fn sets_of_integration_times_have_their_own_terms() {
    let mut truth = small();
    for (index, station) in truth.stations.iter_mut().enumerate() {
        station.integration_time_s = Some(if index % 2 == 0 { 0.002 } else { 0.004 });
    }
    let mut observed = simulate_sightings(&truth, &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    // The longer time shows everything 50 mm further off.
    for seen in observed.sightings.iter_mut().filter(|seen| seen.station % 2 == 1) {
        seen.range_m = seen.range_m.map(|range| range + 0.05);
    }
    let terms = TermSelection::List(["xp", "yp", "c", "k1", "p1", "p2", "d0", "d6", "d7"].map(str::to_owned).to_vec());
    let outcome = calibrate(&observed, &CalibrationOptions { terms, ..options() }).unwrap();
    let [first, second] = ["d0", "d0@0.004"].map(|name| outcome.parameter(name).unwrap());
    assert!((second.value - first.value - 0.05).abs() < 0.005, "{} {}", first.value, second.value);
    assert_eq!(outcome.range_models.len(), 2);
    assert!(outcome.range_models.iter().all(|(time, model)| time.is_some() && model.range_span_m.is_some()));
}

#[test]
fn a_spline_stands_instead_of_the_sines() {
    let mut truth = small();
    let sines = truth.range_model.terms;
    truth.range_model.terms = RangeTerms { d0: sines.d0, e1: sines.e1, e2: sines.e2, ..RangeTerms::default() };
    let knots = vec![0.004, -0.006, 0.003, 0.005, -0.004, 0.002, -0.003];
    truth.range_model.further.spline = Some(PeriodicSpline { coefficients: knots });
    let mut observed = simulate_sightings(&truth, &SightingOptions::default()).unwrap();
    nominal(&mut observed);
    observed.range_model.further.spline = Some(PeriodicSpline::zero(8).unwrap());
    // The ranges span 1.2 m to 4.5 m of 5 m: the knots from 1.2 m (s2) to 4.4 m (s6) are seen, the others held.
    observed.range_model.further.spline.as_mut().unwrap().coefficients[..2].copy_from_slice(&[0.004, -0.006]);
    let names = ["xp", "yp", "c", "k1", "k2", "p1", "p2", "d0", "s3", "s4", "s5", "e1", "e2"];
    observed.range_model.further.spline.as_mut().unwrap().coefficients[2] = 0.003;
    observed.range_model.further.spline.as_mut().unwrap().coefficients[6] = -0.003;
    let terms = TermSelection::List(names.map(str::to_owned).to_vec());
    let outcome = calibrate(&observed, &CalibrationOptions { terms, ..options() }).unwrap();
    for (name, value) in [("s3", 0.005), ("s4", -0.004), ("s5", 0.002)] {
        let found = outcome.parameter(name).unwrap();
        assert!((found.value - value).abs() < 4.0 * found.sigma_prior, "{name}: {} {}", found.value, found.sigma_prior);
        assert_eq!(found.unit, "m");
    }
}
