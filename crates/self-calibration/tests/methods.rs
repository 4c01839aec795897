//! All methods: the truth without noise, and honest deviations with it.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod support;

use nalgebra::DVector;
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Method, Network, NetworkDatum, SightingOptions, SimulatedStart,
    TermSelection, calibrate, calibrate_two_networks, simulate_sightings,
};
use support::networks::{
    all_but_long_wave, nominal, small, track_network, with_control, with_passive, with_scale_bars,
};

struct Case {
    name: &'static str,
    method: Method,
    datum: NetworkDatum,
    truth: Network,
    /// The network of the lens, where there are two.
    lens: Option<Network>,
}

fn cases() -> Vec<Case> {
    let case = |name, method, datum, truth| Case { name, method, datum, truth, lens: None };
    vec![
        case("one step, free", Method::OneStep, NetworkDatum::Free, small()),
        case("one step, scale bars", Method::OneStep, NetworkDatum::Free, with_scale_bars(small())),
        case("one step, control", Method::OneStep, NetworkDatum::Control, with_control(small())),
        case("dependent, scale from ranges", Method::TwoStepDependent, NetworkDatum::Free, small()),
        case("dependent, scale bars", Method::TwoStepDependent, NetworkDatum::Free, with_scale_bars(small())),
        case("dependent, control", Method::TwoStepDependent, NetworkDatum::Control, with_control(small())),
        case("joint integrated", Method::JointIntegrated, NetworkDatum::Free, with_passive(small())),
        case("joint two steps", Method::JointTwoStep, NetworkDatum::Control, with_passive(with_control(small()))),
        case("laboratory", Method::Laboratory, NetworkDatum::Free, track_network()),
        Case {
            lens: Some(with_scale_bars(small())),
            ..case("independent", Method::TwoStepIndependent, NetworkDatum::Free, with_control(small()))
        },
    ]
}

fn calibrated(case: &Case, sightings: &SightingOptions, options: &CalibrationOptions) -> CalibrationOutcome {
    let options = CalibrationOptions { method: case.method, datum: case.datum, ..options.clone() };
    let observe = |truth: &Network, sightings: &SightingOptions| {
        let mut observed = simulate_sightings(truth, sightings).unwrap();
        if case.method != Method::Laboratory {
            nominal(&mut observed);
        }
        observed
    };
    let observed = observe(&case.truth, sightings);
    let found = match &case.lens {
        None => calibrate(&observed, &options),
        Some(lens) => {
            let other = SightingOptions { seed: sightings.seed + 1_000_000, ..sightings.clone() };
            calibrate_two_networks(&observe(lens, &other), &observed, &options)
        }
    };
    found.unwrap_or_else(|error| panic!("{}: {error}", case.name))
}

/// Differences of the estimated parameters from the truth.
fn errors(case: &Case, outcome: &CalibrationOutcome) -> DVector<f64> {
    let camera = &case.truth.camera;
    let [xp, yp] = camera.interior.principal_point_mm;
    let lens = camera.lens;
    let terms = case.truth.range_model.terms.to_array();
    let true_value = |name: &str| match name {
        "xp" => xp,
        "yp" => yp,
        "c" => camera.interior.principal_distance_mm,
        "k1" => lens.k1,
        "k2" => lens.k2,
        "k3" => lens.k3,
        "p1" => lens.p1,
        "p2" => lens.p2,
        name => terms[error_models::RangeTerms::NAMES.iter().position(|known| *known == name).unwrap()],
    };
    let difference = |name: &String| outcome.parameter(name).unwrap().value - true_value(name);
    DVector::from_iterator(outcome.estimated.len(), outcome.estimated.iter().map(difference))
}

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
        println!("{}: {:?} {:?}", case.name, outcome.sigma0, outcome.diagnosis);
        for (i, name) in outcome.estimated.iter().enumerate() {
            let sigma = outcome.covariance[(i, i)].sqrt();
            println!("   {name} {:.2e} {sigma:.2e}", errors[i]);
            // Four deviations of a thousandth of the usual noise.
            assert!(errors[i].abs() < 5.0 * sigma, "{}: {name} is off by {} of {sigma}", case.name, errors[i]);
        }
    }
}

#[test]
fn deviations_are_honest() {
    let runs = 20;
    for case in cases() {
        let started = std::time::Instant::now();
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
        println!("{}: chi-squared per unknown {ratio:.3} {:?}", case.name, started.elapsed());
    }
}
