//! All methods, each with a network that suits it.

use nalgebra::DVector;
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Method, Network, NetworkDatum, SightingOptions, calibrate,
    calibrate_two_networks, simulate_sightings,
};

use super::networks::{nominal, small, track_network, with_control, with_passive, with_scale_bars};

/// A method and a network for it.
pub struct Case {
    pub name: &'static str,
    pub method: Method,
    pub datum: NetworkDatum,
    pub truth: Network,
    /// The network of the lens, where there are two.
    pub lens: Option<Network>,
}

pub fn cases() -> Vec<Case> {
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

/// Observes the truth and calibrates.
pub fn calibrated(case: &Case, sightings: &SightingOptions, options: &CalibrationOptions) -> CalibrationOutcome {
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
pub fn errors(case: &Case, outcome: &CalibrationOutcome) -> DVector<f64> {
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
        "b1" => lens.b1,
        "b2" => lens.b2,
        name => terms[error_models::RangeTerms::NAMES.iter().position(|known| *known == name).unwrap()],
    };
    let difference = |name: &String| outcome.parameter(name).unwrap().value - true_value(name);
    DVector::from_iterator(outcome.estimated.len(), outcome.estimated.iter().map(difference))
}
