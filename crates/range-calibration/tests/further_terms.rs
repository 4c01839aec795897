//! Spline, polynomial and surface from dense range differences.

use crate::support;
use crate::support::{INTERVAL, track, walls};
use error_models::{FurtherShape, PolynomialShape, RangeErrorModel, SurfaceShape};
use range_calibration::{Error, RangeDifference, RangeTermOptions, Scale, estimate_range_terms};

const SIGMA_M: f64 = 0.004;

fn polynomial() -> PolynomialShape {
    PolynomialShape { order: 2, range_span_m: [0.5, 6.5] }
}

fn surface() -> SurfaceShape {
    SurfaceShape { order: 3, x_span_mm: [-3.3, 3.3], y_span_mm: [-2.64, 2.64] }
}

/// A model of this shape with coefficients of some millimetres.
fn truth(further: FurtherShape) -> RangeErrorModel {
    let mut model = RangeErrorModel::error_free(INTERVAL).with_further(&further).unwrap();
    let values: Vec<f64> = (0..model.parameter_count()).map(|i| 0.006 * (1.0 + 2.3 * i as f64).sin()).collect();
    model.set_parameter_values(&values).unwrap();
    model
}

fn options(further: FurtherShape) -> RangeTermOptions {
    RangeTermOptions { further, ..RangeTermOptions::default() }
}

fn shapes() -> [FurtherShape; 4] {
    let none = FurtherShape::default();
    [
        FurtherShape { spline_knots: Some(12), ..none },
        FurtherShape { polynomial: Some(polynomial()), ..none },
        FurtherShape { surface: Some(surface()), ..none },
        FurtherShape { spline_knots: Some(8), polynomial: Some(polynomial()), surface: Some(surface()) },
    ]
}

#[test]
fn without_noise_all_coefficients_come_back() {
    for shape in shapes() {
        let truth = truth(shape);
        let calibration = estimate_range_terms(&walls(&truth, &track(), 1e-9, 3), INTERVAL, &options(shape)).unwrap();
        for (found, expected) in calibration.model().parameter_values().iter().zip(truth.parameter_values()) {
            // Noise of 1e-9 m in thousands of differences, inflated ten times at most.
            assert!((found - expected).abs() < 1e-8, "{shape:?}: {found} {expected}");
        }
        assert_eq!(calibration.model().further.shape(), shape);
        assert_eq!(calibration.estimated_names(), truth.parameter_names());
    }
}

#[test]
fn deviations_are_those_of_the_scatter() {
    let shape = shapes()[3];
    let truth = truth(shape);
    let expected = truth.parameter_values();
    let surveys = 24;
    let mut sum = 0.0;
    for seed in 0..surveys {
        let calibration =
            estimate_range_terms(&walls(&truth, &track(), SIGMA_M, seed), INTERVAL, &options(shape)).unwrap();
        let covariance = calibration.covariance(Scale::Prior).unwrap();
        let found = calibration.model().parameter_values();
        let error = nalgebra::DVector::from_iterator(found.len(), found.iter().zip(&expected).map(|(f, e)| f - e));
        sum += error.dot(&covariance.clone().lu().solve(&error).unwrap()) / found.len() as f64;
    }
    // Chi squared of 24 surveys with 19 unknowns, divided by their number: 1 with a deviation of sqrt(2 / 456) = 0.066.
    let mean = sum / surveys as f64;
    assert!((mean - 1.0).abs() < 0.2, "{mean}");
}

/// What a camera shows whose periodic error is no sum of three sines: a triangular wave.
fn triangular(seed: u64) -> Vec<RangeDifference> {
    let error_free = RangeErrorModel::error_free(INTERVAL);
    let mut differences = walls(&error_free, &track(), SIGMA_M, seed);
    for d in &mut differences {
        let phase = (d.reference_range_m / INTERVAL * 3.0).fract();
        d.observed_range_m += 0.03 * ((2.0 * phase - 1.0).abs() - 0.5);
    }
    differences
}

#[test]
fn schwarz_prefers_sines_for_sines_and_a_spline_for_what_sines_cannot_follow() {
    let criterion = |differences: &[RangeDifference], options: &RangeTermOptions| {
        estimate_range_terms(differences, INTERVAL, options).unwrap().schwarz_criterion()
    };
    let (sines, spline) = (RangeTermOptions::default(), RangeTermOptions::default().with_spline(16));
    for seed in 0..3 {
        let of_sines = walls(&support::model(None), &track(), SIGMA_M, seed);
        assert!(criterion(&of_sines, &sines) < criterion(&of_sines, &spline), "seed {seed}");
        let of_triangles = triangular(seed);
        assert!(criterion(&of_triangles, &spline) < criterion(&of_triangles, &sines), "seed {seed}");
    }
    let rest =
        |options: &RangeTermOptions| estimate_range_terms(&triangular(9), INTERVAL, options).unwrap().rms_after_m();
    // The wave of wavelength U/3 is none of the sines': its rms of 8.7 mm stays beside the noise; the spline takes it.
    assert!(rest(&sines) > 0.009 && rest(&spline) < 0.0043, "{} {}", rest(&sines), rest(&spline));
}

#[test]
fn what_the_ranges_do_not_cover_is_refused_by_name() {
    let near: Vec<f64> = (0..8).map(|step| 0.6 + 0.2 * f64::from(step)).collect();
    let differences = walls(&support::model(None), &near, SIGMA_M, 1);
    let answer = estimate_range_terms(&differences, INTERVAL, &RangeTermOptions::default().with_spline(12));
    match answer {
        Err(Error::NotDetermined { combination, .. }) => assert!(combination.contains('s'), "{combination}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn differences_outside_the_spans_and_terms_held_beside_are_refused() {
    let differences = walls(&support::model(None), &track(), SIGMA_M, 1);
    let estimate = |options: RangeTermOptions| estimate_range_terms(&differences, INTERVAL, &options).unwrap_err();
    let default = RangeTermOptions::default();
    let short = PolynomialShape { order: 2, range_span_m: [0.5, 3.0] };
    let answer = estimate(default.with_polynomial(short));
    assert!(matches!(answer, Error::BadDifference { name: "observed_range_m", .. }), "{answer}");
    let answer = estimate(default.with_surface(SurfaceShape { x_span_mm: [-1.0, 1.0], ..surface() }));
    assert!(matches!(answer, Error::BadDifference { name: "x_mm", .. }), "{answer}");
    for bad in [
        default.with_spline(3),
        default.with_spline(8).hold("d4", 0.01).unwrap(),
        default.with_surface(surface()).hold("e1", 0.01).unwrap(),
        default.with_polynomial(PolynomialShape { order: 0, ..polynomial() }),
    ] {
        assert!(matches!(estimate(bad), Error::Model(_)), "{bad:?}");
    }
    // Held at zero is not there either: nothing is said twice.
    let held = default.with_spline(8).hold("d4", 0.0).unwrap();
    assert!(estimate_range_terms(&differences, INTERVAL, &held).is_ok());
}
