//! Eqs. 14 and 15 pixel by pixel: values, derivatives, inverse, domain.

use std::f64::consts::PI;

use approx::assert_relative_eq;
use error_models::{AmplitudeHyperbola, Error, ModelSet, RangeErrorModel, RangeTerms};
use proptest::prelude::*;

const INTERVAL: f64 = 7.494_811_45;

fn terms() -> RangeTerms {
    RangeTerms { d0: 0.024, periodic: [0.01, -0.02, 0.03, 0.01, -0.005, 0.006], e1: 3e-3, e2: -2e-3 }
}

fn hyperbola() -> AmplitudeHyperbola {
    AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 900.0] }
}

fn model() -> RangeErrorModel {
    RangeErrorModel {
        ambiguity_interval_m: INTERVAL,
        terms: terms(),
        hyperbola: Some(hyperbola()),
        ..RangeErrorModel::error_free(INTERVAL)
    }
}

#[test]
fn eq_14_is_the_sum_written_in_the_chapter() {
    let (t, range, x, y) = (terms(), 11.3, -1.7, 2.9);
    let mut expected = t.d0 + t.e1 * x + t.e2 * y;
    for m in 1..=3_i32 {
        let argument = 2.0_f64.powi(m) * PI * range / INTERVAL;
        let pair = 2 * (m as usize - 1);
        expected += t.periodic[pair] * argument.sin() + t.periodic[pair + 1] * argument.cos();
    }
    // Doubling the angle twice costs a few units in the last place of the coefficients.
    assert_relative_eq!(t.correction(INTERVAL, range, x, y), expected, epsilon = 1e-15);
}

#[test]
fn eq_15_is_the_formula_written_in_the_chapter() {
    for (h1, h2, h3) in [(1e-3, 2e-2, 90.0), (-2e-3, -1e-3, 50.0), (2e-3, 0.0, -10.0), (1e-3, 2e-2, -90.0)] {
        let hyperbola = AmplitudeHyperbola { h1, h2, h3, amplitude_span: [501.0, 900.0] };
        for a in [501.0, 640.0, 900.0] {
            let radicand: f64 = (h2 / h3 * a).powi(2) - 2.0 * h1 / h3 * a + 1.0 / h3;
            let expected = -h2 / h3 * a + radicand.sqrt();
            assert!(radicand > 0.0);
            // The formula as written loses up to two digits to cancellation.
            assert_relative_eq!(hyperbola.correction(a).unwrap(), expected, epsilon = 1e-13);
        }
    }
}

#[test]
fn periodic_terms_repeat_beyond_the_ambiguity_interval() {
    for wraps in [1.0, 3.0, 1000.0] {
        let (near, far) = (1.234, 1.234 + wraps * INTERVAL);
        let t = terms();
        // A range of 7 km is resolved to 1e-12 m, and the terms change by less than 0.2 m per metre.
        assert_relative_eq!(
            t.periodic_correction(INTERVAL, far),
            t.periodic_correction(INTERVAL, near),
            epsilon = 1e-12
        );
    }
}

#[test]
fn an_amplitude_outside_the_span_has_no_correction() {
    let h = hyperbola();
    assert!(h.correction(20.0).is_some() && h.correction(900.0).is_some());
    for amplitude in [19.999, 900.001, f64::NAN, f64::INFINITY, -1.0] {
        assert_eq!(h.correction(amplitude), None);
        assert!(h.jacobian(amplitude).is_none());
    }
}

/// Central difference of `f` at `x` with a step of `h`.
fn difference(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    (f(x + h) - f(x - h)) / (2.0 * h)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn the_design_row_is_the_derivative_and_the_terms_are_linear(
        values in proptest::array::uniform9(-0.05..0.05_f64), range in 0.0..40.0_f64, x in -3.0..3.0_f64, y in -3.0..3.0_f64,
    ) {
        let t = RangeTerms::from_array(values);
        let row = RangeTerms::design_row(INTERVAL, range, x, y);
        let product: f64 = row.iter().zip(values).map(|(d, v)| d * v).sum();
        prop_assert!((product - t.correction(INTERVAL, range, x, y)).abs() < 1e-15);
        // Central differences with a step of 1e-4 m err by h^2/6 times the third derivative (below 30 m^-2 * 0.3 m).
        let slope = difference(|range| t.correction(INTERVAL, range, x, y), range, 1e-4);
        prop_assert!((slope - t.range_derivative(INTERVAL, range)).abs() < 1e-7);
    }

    #[test]
    fn the_jacobian_of_the_hyperbola_is_its_derivative(
        h1 in -1e-3..1e-3_f64, h2 in 5e-3..5e-2_f64, h3 in 20.0..200.0_f64, amplitude in 25.0..800.0_f64,
    ) {
        let h = AmplitudeHyperbola { h1, h2, h3, amplitude_span: [10.0, 1000.0] };
        let value = |h: AmplitudeHyperbola, a: f64| h.correction(a).unwrap();
        prop_assume!(h.correction(amplitude).is_some());
        let jacobian = h.jacobian(amplitude).unwrap();
        let numeric = [
            difference(|h1| value(AmplitudeHyperbola { h1, ..h }, amplitude), h1, 1e-8),
            difference(|h2| value(AmplitudeHyperbola { h2, ..h }, amplitude), h2, 1e-7),
            difference(|h3| value(AmplitudeHyperbola { h3, ..h }, amplitude), h3, 1e-3),
        ];
        for (analytic, numeric) in jacobian.coefficients.into_iter().zip(numeric) {
            // Rounding of a value near 0.1 over a step: 1e-17 / 1e-8 relative to derivatives of 1e-5 to 1e3.
            prop_assert!((analytic - numeric).abs() < 1e-5 * analytic.abs().max(1e-3), "{analytic} {numeric}");
        }
        let numeric = difference(|a| value(h, a), amplitude, 1e-3);
        prop_assert!((jacobian.amplitude - numeric).abs() < 1e-5 * numeric.abs().max(1e-5));
    }

    #[test]
    fn observed_ranges_are_inverted_to_machine_precision(
        values in proptest::array::uniform9(-0.1..0.1_f64), range in 0.0..40.0_f64, x in -3.0..3.0_f64, amplitude in 20.0..900.0_f64,
    ) {
        let model = RangeErrorModel { terms: RangeTerms::from_array(values), ..model() };
        prop_assume!(model.validate().is_ok());
        let observed = model.observed_range(range, x, -x, amplitude).unwrap();
        let back = model.corrected_range(observed, x, -x, amplitude);
        // Four units in the last place of 40 m.
        prop_assert!((back - range).abs() < 4.0 * 40.0 * f64::EPSILON, "{range} {observed} {back}");
    }
}

#[test]
fn terms_that_fold_the_ranges_are_refused() {
    // The steepest slope of a sine of 0.2 m at the wavelength U/4 is 8 pi 0.2 / U.
    let slope = 8.0 * PI * 0.2 / INTERVAL;
    let gentle = RangeTerms { periodic: [0.0, 0.0, 0.0, 0.0, 0.2, 0.0], ..RangeTerms::default() };
    let model = RangeErrorModel { terms: gentle, hyperbola: None, ..model() };
    assert!(slope < 1.0 && model.validate().is_ok());
    let steep = RangeTerms { periodic: [0.0, 0.0, 0.0, 0.0, 0.2, 0.3], ..gentle };
    let model = RangeErrorModel { terms: steep, ..model };
    let Err(Error::NotMonotone { slope, range_m }) = model.validate() else { panic!("accepted") };
    assert_relative_eq!(slope, 8.0 * PI * 0.2_f64.hypot(0.3) / INTERVAL, max_relative = 1e-9);
    assert_relative_eq!(slope, steep.range_derivative(INTERVAL, range_m), max_relative = 1e-12);
    assert!(matches!(model.observed_range(1.0, 0.0, 0.0, 0.0), Err(Error::NotMonotone { .. })));
    // In a span that ends before the steep part the same terms can be inverted.
    let flat = RangeErrorModel { range_span_m: Some([range_m + 0.7, range_m + 1.1]), ..model };
    assert!(flat.validate().is_ok());
}

#[test]
fn slopes_just_below_one_are_still_inverted() {
    // All three pairs steepest at one place, together 0.999.
    let wave = |m: f64| 0.333 * INTERVAL / (2.0 * PI * m);
    let terms = RangeTerms { periodic: [wave(1.0), 0.0, wave(2.0), 0.0, wave(4.0), 0.0], ..RangeTerms::default() };
    let model = RangeErrorModel { terms, hyperbola: None, ..model() };
    model.validate().unwrap();
    for step in 0..2000 {
        let range = f64::from(step) * 0.01;
        let observed = model.observed_range(range, 0.0, 0.0, 0.0).unwrap();
        let back = model.corrected_range(observed, 0.0, 0.0, 0.0);
        assert!((back - range).abs() <= 4.0 * 20.0 * f64::EPSILON, "{range} {back}");
    }
}

#[test]
fn bad_models_are_refused_by_name() {
    let name = |model: &RangeErrorModel| match model.validate() {
        Err(Error::OutOfDomain { name, .. }) => name,
        other => panic!("{other:?}"),
    };
    for interval in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(name(&RangeErrorModel { ambiguity_interval_m: interval, ..model() }), "ambiguity_interval_m");
    }
    for (index, parameter) in RangeTerms::NAMES.into_iter().enumerate() {
        let mut values = terms().to_array();
        values[index] = f64::NAN;
        assert_eq!(name(&RangeErrorModel { terms: RangeTerms::from_array(values), ..model() }), parameter);
    }
    let with = |hyperbola| RangeErrorModel { hyperbola: Some(hyperbola), ..model() };
    assert_eq!(name(&with(AmplitudeHyperbola { h3: 0.0, ..hyperbola() })), "h3");
    assert_eq!(name(&with(AmplitudeHyperbola { h2: f64::INFINITY, ..hyperbola() })), "h2");
    assert_eq!(name(&with(AmplitudeHyperbola { amplitude_span: [9.0, 9.0], ..hyperbola() })), "amplitude_span");
    assert_eq!(name(&RangeErrorModel { range_span_m: Some([2.0, 1.0]), ..model() }), "range_span_m");
    assert!(model().validate().is_ok());
}

#[test]
fn ranges_that_are_no_numbers_are_refused_or_outside() {
    assert!(matches!(model().observed_range(f64::NAN, 0.0, 0.0, 100.0), Err(Error::OutOfDomain { .. })));
    assert!(matches!(model().observed_range(1.0, f64::INFINITY, 0.0, 100.0), Err(Error::OutOfDomain { .. })));
    assert!(model().correction(f64::NAN, 0.0, 0.0, 100.0).outside_span);
    assert!(model().correction(1e9, 0.0, 0.0, 100.0).outside_span);
}

#[test]
fn sets_answer_by_integration_time() {
    let at = |d0: f64| vec![RangeErrorModel { terms: RangeTerms { d0, ..terms() }, ..model() }];
    let set = ModelSet { entries: vec![(0.001, at(0.1)), (0.002, at(0.2)), (0.01, at(0.3))] };
    set.validate().unwrap();
    assert_relative_eq!(set.select(0.002 * (1.0 + 1e-7)).unwrap()[0].terms.d0, 0.2);
    assert_relative_eq!(set.select_nearest(0.009, 0.2).unwrap()[0].terms.d0, 0.3);
    let available_s = vec![0.001, 0.002, 0.01];
    let missing = Error::NoModelForIntegrationTime { integration_time_s: 0.0021, available_s };
    assert_eq!(set.select(0.0021).unwrap_err(), missing);
    assert!(missing.to_string().contains("[0.001, 0.002, 0.01]"));
    assert!(set.select(f64::NAN).is_err());
    assert!(ModelSet::default().select(0.002).is_err());
    for entries in [
        vec![(0.002, at(0.1)), (0.001, at(0.2))],
        vec![(0.002, at(0.1)), (0.002, at(0.2))],
        vec![(0.002, vec![])],
        vec![(0.001, at(0.1)), (0.002, [at(0.1), at(0.1)].concat())],
        vec![(f64::NAN, at(0.1))],
        vec![(0.001, at(f64::NAN))],
    ] {
        assert!(ModelSet { entries }.validate().is_err());
    }
}
