//! Further terms of a network by their words: spline, polynomial and surface.

use crate::support::networks::{deep, nominal, small, track_network, with_scale_bars};
use error_models::{FurtherShape, PolynomialShape, RangeErrorModel, SurfaceShape};
use nalgebra::DVector;
use self_calibration::{
    CalibrationOptions, CalibrationOutcome, Error, Method, Network, NetworkError, PlanOptions, SightingOptions,
    TermSelection, calibrate, plan, simulate_sightings,
};

const LENS: &str = "xp yp c k1 k2 p1 p2";

fn list(names: &str) -> TermSelection {
    TermSelection::List(names.split(' ').map(str::to_owned).collect())
}

fn options(range_terms: &str) -> CalibrationOptions {
    let terms = list(&format!("{LENS} {range_terms}"));
    CalibrationOptions { terms, rejection_level: None, ..CalibrationOptions::default() }
}

fn observed(truth: &Network) -> Network {
    let options = SightingOptions { sigma_range_m: 0.005, ..SightingOptions::default() };
    let mut observed = simulate_sightings(truth, &options).unwrap();
    nominal(&mut observed);
    observed.range_model = RangeErrorModel::error_free(truth.range_model.ambiguity_interval_m);
    observed
}

/// Standard deviation of a correction by the found terms.
fn deviation(outcome: &CalibrationOutcome, range_m: f64, x_mm: f64, y_mm: f64) -> f64 {
    let model = &outcome.range_models[0].1;
    let mut row = DVector::zeros(outcome.estimated.len());
    for (name, derivative) in model.parameter_names().iter().zip(model.design_row(range_m, x_mm, y_mm)) {
        if let Some(place) = outcome.estimated.iter().position(|known| known == name) {
            row[place] = derivative;
        }
    }
    row.dot(&(&outcome.covariance * &row)).sqrt()
}

/// Corrections over the observed ranges and the image against the truth: within four deviations and what the model cannot
/// follow at each place, within 3 mm on the whole.
fn assert_corrects(outcome: &CalibrationOutcome, truth: &Network, model_error_m: f64) {
    let (found, true_model) = (&outcome.range_models[0].1, &truth.range_model);
    let [low, high] = found.range_span_m.unwrap();
    let ([fx, fy], [tx, ty]) = (outcome.camera.interior.principal_point_mm, truth.camera.interior.principal_point_mm);
    let mut squares = Vec::new();
    for step in 0..=60 {
        let range_m = low + (high - low) * f64::from(step) / 60.0;
        for [x, y] in [[0.0, 0.0], [2.5, 1.5], [-2.5, 2.0], [2.0, -2.0], [-1.0, -2.0]] {
            let correction = found.correction(range_m, x - fx, y - fy, f64::NAN).total_m();
            let expected = true_model.correction(range_m, x - tx, y - ty, f64::NAN).total_m();
            let (sigma, error) = (deviation(outcome, range_m, x - fx, y - fy), correction - expected);
            assert!(error.abs() < 4.0 * sigma + model_error_m, "at {range_m} m, ({x}, {y}): {error} of {sigma}");
            squares.push(error * error);
        }
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(rms < 0.003, "{rms} m");
}

#[test]
fn a_spline_follows_sines() {
    let truth = deep();
    let outcome = calibrate(&observed(&truth), &options("d0 spline12 e1 e2")).unwrap();
    // Three knots to the wave of 10 mm at U/4: a spline misses 6 % of it.
    assert_corrects(&outcome, &truth, 0.001);
    assert_eq!(outcome.estimated.iter().filter(|name| name.starts_with('s')).count(), 11);
    assert_eq!(outcome.range_models[0].1.further.shape().spline_knots, Some(12));
    assert!(outcome.parameter("d4").is_none());
}

#[test]
fn a_surface_follows_a_surface() {
    let mut truth = deep();
    let camera = truth.camera;
    let surface = SurfaceShape::over_image(2, &camera.format, camera.interior.principal_point_mm);
    let shape = FurtherShape { surface: Some(surface), ..FurtherShape::default() };
    truth.range_model = truth.range_model.with_further(&shape).unwrap();
    let coefficients = &mut truth.range_model.further.surface.as_mut().unwrap().coefficients;
    coefficients.copy_from_slice(&[0.006, -0.005, 0.008, 0.009, -0.007]);
    let outcome = calibrate(&observed(&truth), &options("d0 d4 d5 d6 d7 surface2")).unwrap();
    assert_corrects(&outcome, &truth, 0.0);
    assert!(outcome.parameter("g11").unwrap().significance_p < 1e-3 && outcome.parameter("e1").is_none());
}

#[test]
fn a_polynomial_lies_over_the_observed_ranges() {
    let mut truth = with_scale_bars(deep());
    let polynomial = Some(PolynomialShape { order: 3, range_span_m: [0.9, 8.5] });
    truth.range_model =
        truth.range_model.with_further(&FurtherShape { polynomial, ..FurtherShape::default() }).unwrap();
    truth.range_model.terms.periodic = [0.0; 6];
    truth.range_model.further.polynomial.as_mut().unwrap().coefficients.copy_from_slice(&[0.006, -0.01, 0.008]);
    let observed = observed(&truth);
    let outcome = calibrate(&observed, &options("d0 e1 e2 polynomial3")).unwrap();
    assert_corrects(&outcome, &truth, 0.0);
    let span = outcome.range_models[0].1.further.polynomial.as_ref().unwrap().range_span_m;
    assert_eq!(Some(span), outcome.range_models[0].1.range_span_m);
}

#[test]
fn a_track_and_a_plan_know_the_words() {
    let truth = track_network();
    let observed = simulate_sightings(&truth, &SightingOptions { sigma_range_m: 0.002, ..Default::default() }).unwrap();
    let laboratory = CalibrationOptions { method: Method::Laboratory, ..options("d0 spline12 e1 e2") };
    let mut start = observed.clone();
    start.range_model = RangeErrorModel::error_free(truth.range_model.ambiguity_interval_m);
    assert_corrects(&calibrate(&start, &laboratory).unwrap(), &truth, 0.001);

    let terms = list(&format!("{LENS} d0 d4 d5 d6 d7 surface2 polynomial2"));
    let mut few = PlanOptions { terms, ..PlanOptions::default() };
    few.candidates.distances_m = vec![2.0];
    let planned = plan(&with_scale_bars(deep()), &few).unwrap();
    for name in ["g10", "g01", "g20", "g11", "g02", "q1", "q2"] {
        let parameter = planned.parameters.iter().find(|parameter| parameter.name == name).unwrap();
        assert!(parameter.sigma_prior > 0.0 && planned.estimated.iter().any(|known| known == name), "{name}");
    }
}

#[test]
fn words_that_contradict_each_other_are_refused() {
    let observed = observed(&small());
    let refused = |terms: &str| calibrate(&observed, &options(terms)).unwrap_err();
    for (terms, named) in [
        ("d0 spline12 d4 d5", ["`spline12`", "`d4`"]),
        ("d0 e1 surface2", ["`surface2`", "`e1`"]),
        ("d0 spline8 spline12", ["`spline8`", "`spline12`"]),
    ] {
        let error = refused(terms);
        assert!(matches!(error, Error::ConflictingTerms { .. }), "{error}");
        assert!(named.iter().all(|name| error.to_string().contains(name)), "{error}");
    }
    for unknown in ["splines", "spline", "s3", "g10", "surface-2"] {
        let error = refused(&format!("d0 {unknown}"));
        assert!(matches!(&error, Error::Network(NetworkError::UnknownName { name, .. }) if name == unknown), "{error}");
        assert!(error.to_string().contains("splineN polynomialN surfaceN"), "{error}");
    }
    // Knots and orders that no model has.
    for impossible in ["spline3", "spline99999", "polynomial0", "surface7"] {
        assert!(matches!(refused(&format!("d0 {impossible}")), Error::Network(NetworkError::Model(_))), "{impossible}");
    }
    // 1.2 m to 4.5 m of an ambiguity interval of 5 m: some knots are not seen at all.
    assert!(matches!(refused("d0 spline12"), Error::Network(NetworkError::WeakNetwork { .. })));
}

#[test]
fn terms_of_the_start_model_stay_beside_a_word() {
    let mut observed = observed(&with_scale_bars(deep()));
    let polynomial = Some(PolynomialShape { order: 2, range_span_m: [0.5, 9.0] });
    let shape = FurtherShape { polynomial, ..FurtherShape::default() };
    observed.range_model = observed.range_model.clone().with_further(&shape).unwrap();
    observed.range_model.further.polynomial.as_mut().unwrap().coefficients[1] = 0.002;
    let outcome = calibrate(&observed, &options("d0 spline12 e1 e2")).unwrap();
    let q2 = outcome.parameter("q2").unwrap();
    assert!((q2.value - 0.002).abs() < 1e-15 && q2.sigma_prior == 0.0, "held at its start value: {q2:?}");
}
