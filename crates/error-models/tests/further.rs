//! Spline, polynomial and surface: values, derivatives, design rows, inverse, frames, files' lists.
// What is left alone, held at zero or on a knot is so to the last bit.

use std::f64::consts::TAU;

use error_models::{
    Error, FurtherShape, FurtherTerms, ImageSurface, ModelShape, NamedParameter, PeriodicSpline, PolynomialShape,
    RangeErrorModel, RangePolynomial, RangeTerms, SurfaceShape, correct_frame, distort_frame, parameter_unit,
};
use proptest::prelude::*;
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

const INTERVAL: f64 = 5.0;
const PRINCIPAL_POINT: [f64; 2] = [0.11, -0.07];

fn shape(knots: usize, order: usize) -> FurtherShape {
    FurtherShape {
        spline_knots: Some(knots),
        polynomial: Some(PolynomialShape { order, range_span_m: [0.2, 14.0] }),
        surface: Some(SurfaceShape { order: order.min(6), x_span_mm: [-1.8, 1.6], y_span_mm: [-1.5, 1.9] }),
    }
}

/// A model of this shape whose coefficients are taken in turn from some numbers.
fn model(shape: &FurtherShape, numbers: &[f64]) -> RangeErrorModel {
    let mut model = RangeErrorModel::error_free(INTERVAL).with_further(shape).unwrap();
    let values: Vec<f64> = numbers.iter().copied().cycle().take(model.parameter_count()).collect();
    model.set_parameter_values(&values).unwrap();
    model
}

/// Shapes of all kinds, parts of them missing.
fn shapes() -> impl Strategy<Value = FurtherShape> {
    (4_usize..40, 1_usize..=8, prop::array::uniform3(any::<bool>())).prop_map(|(knots, order, there)| {
        let full = shape(knots, order);
        FurtherShape {
            spline_knots: full.spline_knots.filter(|_| there[0]),
            polynomial: full.polynomial.filter(|_| there[1]),
            surface: full.surface.filter(|_| there[2]),
        }
    })
}

fn difference(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    (f(x + h) - f(x - h)) / (2.0 * h)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn the_design_row_is_the_derivative_of_a_linear_correction(
        shape in shapes(), numbers in prop::collection::vec(-4e-3..4e-3_f64, 7),
        range in 0.25..13.9_f64, x in -1.7..1.5_f64, y in -1.4..1.8_f64,
    ) {
        let model = model(&shape, &numbers);
        let row = model.design_row(range, x, y);
        prop_assert_eq!(row.len(), model.parameter_names().len());
        let product: f64 = row.iter().zip(model.parameter_values()).map(|(d, v)| d * v).sum();
        let correction = model.correction(range, x, y, f64::NAN);
        // Rounding of some tens of terms of millimetres.
        prop_assert!((product - correction.total_m()).abs() < 1e-15, "{product} {correction:?}");
        prop_assert!(!correction.outside_span);
        // h^2 / 6 times the third derivative: 8 knots a metre, (8)^3 * 0.03 m at most, at h = 1e-5 m.
        let slope = difference(|range| model.correction(range, x, y, f64::NAN).total_m(), range, 1e-5);
        prop_assert!((slope - correction.range_derivative).abs() < 1e-8, "{slope} {correction:?}");
        if let Some(surface) = &model.further.surface {
            let [by_x, by_y] = surface.gradient(x, y);
            prop_assert!((difference(|x| surface.value(x, y), x, 1e-5) - by_x).abs() < 1e-8);
            prop_assert!((difference(|y| surface.value(x, y), y, 1e-5) - by_y).abs() < 1e-8);
        }
    }

    #[test]
    fn observed_ranges_are_inverted_to_machine_precision(
        shape in shapes(), numbers in prop::collection::vec(-0.03..0.03_f64, 7),
        range in 0.5..13.0_f64, x in -3.0..3.0_f64, y in -3.0..3.0_f64,
    ) {
        let model = model(&shape, &numbers);
        prop_assume!(model.validate().is_ok());
        let observed = model.observed_range(range, x, y, f64::NAN).unwrap();
        prop_assume!(model.range_in_span(observed));
        let back = model.corrected_range(observed, x, y, f64::NAN);
        // Sixteen units in the last place of 13 m: four of the solution, and the terms of order 8.
        prop_assert!((back - range).abs() < 16.0 * 13.0 * f64::EPSILON, "{range} {observed} {back}");
    }

    #[test]
    fn lists_of_parameters_come_back(shape in shapes(), numbers in prop::collection::vec(-4e-3..4e-3_f64, 7)) {
        let model = model(&shape, &numbers);
        prop_assert_eq!(model.shape(), ModelShape { further: shape, ..ModelShape::default() });
        let list = model.to_parameters();
        prop_assert!(list.iter().all(|parameter| parameter_unit(&parameter.name) == Some(&*parameter.unit)));
        prop_assert_eq!(RangeErrorModel::from_shape(INTERVAL, &list, &model.shape()).unwrap(), model);
    }

    #[test]
    fn frames_agree_with_the_formulas_and_come_back(shape in shapes(), numbers in prop::collection::vec(-4e-3..4e-3_f64, 7)) {
        let (model, format, before) = (model(&shape, &numbers), ImageFormat::new(75, 70, [0.04, 0.04]).unwrap(), frame());
        let mut after = before.clone();
        let summary = correct_frame(&mut after, &model, &format, PRINCIPAL_POINT, None).unwrap();
        prop_assert_eq!(summary.corrected, 75 * 70);
        prop_assert_eq!(summary.outside_span, 0);
        let mut polynomial = 0.0;
        for (col, row) in (0..75 * 70).map(|i| (i % 75, i / 75)) {
            let [x, y] = format.image_from_pixel([col as f64, row as f64]);
            let range = f64::from(before.range[(col, row)]);
            let correction = model.correction(range, x - PRINCIPAL_POINT[0], y - PRINCIPAL_POINT[1], f64::NAN);
            let (found, expected) = (f64::from(after.range[(col, row)]), range - correction.total_m());
            // Half a unit in the last place of 14 m is 5e-7 m; the phase is good to 3e-7 of an interval, and a spline of
            // 40 knots rises by 8 mm from one to the next: 40 * 3e-7 * 8 mm.
            prop_assert!((found - expected).abs() < 1.5e-6, "{col} {row}: {found} {expected}");
            let sigma = 0.01 * (1.0 - correction.range_derivative).abs();
            prop_assert!((f64::from(after.sigma[(col, row)]) - sigma).abs() < 1e-6);
            polynomial -= correction.polynomial_m;
        }
        // Single-precision sums of 5,250 values of millimetres.
        prop_assert!((summary.polynomial.mean_m - polynomial / 5250.0).abs() < 1e-7);
        distort_frame(&mut after, &model, &format, PRINCIPAL_POINT, None).unwrap();
        for (again, given) in after.range.as_slice().iter().zip(before.range.as_slice()) {
            prop_assert!((again - given).abs() < 3e-6, "{again} {given}");
        }
    }
}

fn frame() -> RangeFrame {
    let spread = |col: usize, row: usize| ((col * 37 + row * 101) % 997) as f32 / 997.0;
    RangeFrame {
        range: Raster::from_fn(75, 70, |col, row| 0.4 + 13.0 * spread(col, row)),
        sigma: Raster::filled(75, 70, 0.01),
        amplitude: Raster::filled(75, 70, f32::NAN),
        flags: Raster::filled(75, 70, Flags::empty()),
    }
}

#[test]
fn a_spline_follows_a_wave_and_has_mean_zero() {
    // Coefficients on a sine make a sine, a little smaller: the B-spline averages neighbours with 1/6, 4/6, 1/6.
    let knots = 24;
    let wave = |k: usize| 0.01 * (TAU * 2.0 * k as f64 / knots as f64).sin();
    let spline = PeriodicSpline { coefficients: (0..knots - 1).map(wave).collect() };
    let shrink = (4.0 + 2.0 * (TAU * 2.0 / knots as f64).cos()) / 6.0;
    let mut mean = 0.0;
    for i in 0..1000 {
        let range = f64::from(i) / 1000.0 * INTERVAL;
        let (value, _) = spline.with_derivative(INTERVAL, range);
        let expected = shrink * 0.01 * (TAU * 2.0 * range / INTERVAL).sin();
        // h^4 / 384 times the fourth derivative: (4 pi / 24)^4 / 384 = 2e-4 of the amplitude, at the knots none.
        assert!((value - expected).abs() < 4e-6, "{range}: {value} {expected}");
        mean += value / 1000.0;
        let (again, _) = spline.with_derivative(INTERVAL, range + 3.0 * INTERVAL);
        assert!((again - value).abs() < 1e-15);
    }
    // Uniform samples of a periodic function: exact but for rounding.
    assert!(mean.abs() < 1e-16, "{mean}");
    assert!(spline.bound() <= 0.01 && spline.knots() == knots);
}

#[test]
fn polynomial_and_surface_are_those_written() {
    let polynomial = RangePolynomial { range_span_m: [1.0, 3.0], coefficients: vec![0.01, 0.02, -0.03] };
    let t = 0.4_f64;
    let expected = 0.01 * t + 0.02 * (1.5 * t * t - 0.5) - 0.03 * (2.5 * t * t * t - 1.5 * t);
    assert!((polynomial.with_derivative(2.4).0 - expected).abs() < 1e-17);
    assert_eq!(polynomial.with_derivative(9.0), (0.01 + 0.02 - 0.03, 0.0));
    let coefficients = vec![0.01, 0.02, 0.03, 0.04, 0.05];
    let surface = ImageSurface { x_span_mm: [-2.0, 2.0], y_span_mm: [0.0, 4.0], coefficients };
    let (s, t) = (0.5_f64, -0.25_f64);
    let expected = 0.01 * s + 0.02 * t + 0.03 * (1.5 * s * s - 0.5) + 0.04 * s * t + 0.05 * (1.5 * t * t - 0.5);
    assert!((surface.value(1.0, 1.5) - expected).abs() < 1e-17);
}

#[test]
fn outside_its_spans_nothing_is_extrapolated() {
    let full = model(&shape(12, 3), &[0.002, -0.003, 0.001]);
    let outside = full.correction(14.01, 0.0, 0.0, f64::NAN);
    assert!(outside.outside_span && outside.total_m() == 0.0);
    let off = full.correction(3.0, 1.7, 0.0, f64::NAN);
    let edge = full.correction(3.0, 1.6, 0.0, f64::NAN);
    assert!(off.outside_span && !edge.outside_span);
    assert!((off.delay_m - edge.delay_m).abs() < 1e-17);
    let format = ImageFormat::new(75, 70, [0.08, 0.04]).unwrap();
    let mut wide = frame();
    wide.range[(40, 30)] = 14.5;
    let summary = correct_frame(&mut wide, &full, &format, [0.0; 2], None).unwrap();
    let inside = |col: usize| (-1.8..=1.6).contains(&((col as f64 - 37.0) * 0.08));
    for col in 0..75 {
        assert_eq!(wide.flags[(col, 20)].contains(Flags::OUTSIDE_SPAN), !inside(col), "{col}");
    }
    assert!(wide.flags[(40, 30)].contains(Flags::OUTSIDE_SPAN) && wide.range[(40, 30)] == 14.5);
    assert_eq!(summary.corrected, 75 * 70 - 1);
}

#[test]
fn parts_that_stand_for_one_another_are_refused_together() {
    let full = model(&shape(8, 2), &[1e-3]);
    let sine = RangeTerms { periodic: [0.0, 1e-3, 0.0, 0.0, 0.0, 0.0], ..full.terms };
    let delay = RangeTerms { e2: 1e-3, ..full.terms };
    for (terms, expected) in [(sine, "d2 to d7"), (delay, "e1, e2")] {
        match (RangeErrorModel { terms, ..full.clone() }).validate() {
            Err(Error::OutOfDomain { name, .. }) => assert_eq!(name, expected),
            other => panic!("{other:?}"),
        }
    }
    let with_sines = RangeErrorModel { terms: sine, ..RangeErrorModel::error_free(INTERVAL) };
    let offset_alone = RangeTerms { d0: full.terms.d0, ..RangeTerms::default() };
    assert_eq!(with_sines.with_further(&shape(8, 2)).unwrap().terms, offset_alone);
}

#[test]
fn steep_terms_are_refused() {
    let mut steep = model(&FurtherShape { spline_knots: Some(10), ..FurtherShape::default() }, &[0.0]);
    steep.further.spline = Some(PeriodicSpline { coefficients: vec![0.0, 0.0, 0.0, -0.5, 0.5, 0.0, 0.0, 0.0, 0.0] });
    match steep.validate() {
        // Between knots 3 and 4, in the middle: 10 / 5 m times (3/4 of the step of 1 m, less 1/8 of half a metre twice).
        Err(Error::NotMonotone { slope, range_m }) => {
            assert!((slope - 2.0 * (0.75 - 0.125)).abs() < 1e-9 && (range_m - 1.75).abs() < 1e-6, "{slope} {range_m}");
        }
        other => panic!("{other:?}"),
    }
    // Where nothing is steep the span is all that counts.
    assert!(RangeErrorModel { range_span_m: Some([3.0, 5.0]), ..steep.clone() }.validate().is_ok());
    let polynomial = RangePolynomial { range_span_m: [0.0, 1.0], coefficients: vec![0.0, 0.2] };
    let further = FurtherTerms { polynomial: Some(polynomial), ..FurtherTerms::default() };
    let bent = RangeErrorModel { further, ..RangeErrorModel::error_free(INTERVAL) };
    // 0.2 * 3 t * 2 / m at t = 1.
    assert!(matches!(bent.validate(), Err(Error::NotMonotone { slope, .. }) if (slope - 1.2).abs() < 1e-9));
    assert!(bent.observed_range(0.5, 0.0, 0.0, 1.0).is_err());
}

#[test]
fn bad_shapes_and_numbers_are_refused() {
    let with = |shape: FurtherShape| RangeErrorModel::error_free(INTERVAL).with_further(&shape);
    let bad = [
        shape(3, 2),
        shape(257, 2),
        shape(8, 0),
        shape(8, 9),
        FurtherShape { polynomial: Some(PolynomialShape { order: 2, range_span_m: [2.0, 2.0] }), ..shape(8, 2) },
        FurtherShape { polynomial: Some(PolynomialShape { order: 2, range_span_m: [f64::NAN, 2.0] }), ..shape(8, 2) },
        FurtherShape {
            surface: Some(SurfaceShape { order: 7, x_span_mm: [0.0, 1.0], y_span_mm: [0.0, 1.0] }),
            ..shape(8, 2)
        },
        FurtherShape {
            surface: Some(SurfaceShape { order: 2, x_span_mm: [1.0, 0.0], y_span_mm: [0.0, 1.0] }),
            ..shape(8, 2)
        },
    ];
    for shape in bad {
        assert!(with(shape).is_err(), "{shape:?}");
    }
    let mut good = with(shape(8, 2)).unwrap();
    assert!(matches!(good.set_parameter_values(&[0.0]), Err(Error::WrongLength { found: 1, expected: 15, .. })));
    assert!(good.set_parameter_values(&[f64::NAN; 15]).is_err());
    assert!(good.design_row_into(1.0, 0.0, 0.0, &mut [0.0; 3]).is_err());
    assert_eq!(good, with(shape(8, 2)).unwrap());
    let odd = ImageSurface { coefficients: vec![0.0; 3], ..good.further.surface.clone().unwrap() };
    assert!(odd.validate().is_err() && odd.value(0.0, 0.0) == 0.0);
    let s7 = NamedParameter::held("s7", 0.0).unwrap();
    for name in ["s", "s-1", "s01", "s+1", "q0", "q9", "g00", "g1", "g70", "g43", "g-1", "gab", "g001", "x1", "", "ß"]
    {
        assert_eq!(parameter_unit(name), None, "{name}");
    }
    // A spline of eight knots ends with s6.
    let answer = RangeErrorModel::from_shape(INTERVAL, &[s7], &good.shape());
    assert!(matches!(answer, Err(Error::UnknownParameter { name, .. }) if name == "s7"));
    let d2 = NamedParameter::held("d2", 1e-3).unwrap();
    assert!(RangeErrorModel::from_shape(INTERVAL, &[d2], &good.shape()).is_err());
}
