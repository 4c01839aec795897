//! The ledger: parts of the correction, term by term, at a pixel and over a frame.

use error_models::{
    AmplitudeHyperbola, FixedPattern, FurtherShape, OutsideModel, PolynomialShape, RangeErrorModel, RangeTerm,
    RangeTerms, SurfaceShape, correct_frame, ledger_maps,
};
use proptest::prelude::*;
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

const INTERVAL_M: f64 = 5.0;
const SPAN_M: [f64; 2] = [0.2, 14.0];

/// A model with a random choice of parts.
fn models() -> impl Strategy<Value = RangeErrorModel> {
    let parts = prop::array::uniform4(any::<bool>());
    (parts, prop::collection::vec(-4e-3..4e-3_f64, 7)).prop_map(|([spline, polynomial, surface, dark], numbers)| {
        let shape = FurtherShape {
            spline_knots: spline.then_some(9),
            polynomial: polynomial.then_some(PolynomialShape { order: 3, range_span_m: SPAN_M }),
            surface: surface.then_some(SurfaceShape { order: 2, x_span_mm: [-1.8, 1.6], y_span_mm: [-1.5, 1.9] }),
        };
        let mut model = RangeErrorModel::error_free(INTERVAL_M).with_further(&shape).unwrap();
        let values: Vec<f64> = numbers.iter().copied().cycle().take(model.parameter_count()).collect();
        model.set_parameter_values(&values).unwrap();
        model.range_span_m = Some(SPAN_M);
        let amplitude_span = [10.0, 900.0];
        model.hyperbola = dark.then_some(AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span });
        model
    })
}

proptest! {
    #[test]
    fn the_entries_add_up_to_the_correction(
        model in models(), range in 0.1..15.0_f64, x in -2.0..2.0_f64, y in -2.0..2.0_f64,
        amplitude in 1.0..1000.0_f64, pattern in prop::option::of(-0.01..0.01_f64),
    ) {
        let correction = model.correction(range, x, y, amplitude);
        let ledger = model.ledger(range, x, y, amplitude, pattern);
        let sum: f64 = ledger.iter().map(|entry| entry.change_m).sum();
        let pattern = if model.range_in_span(range) { pattern.unwrap_or(0.0) } else { 0.0 };
        // A dozen numbers below 0.1 m, each rounded once.
        prop_assert!((sum + correction.total_m() + pattern).abs() < 1e-15, "{} {}", sum, correction.total_m());
        prop_assert_eq!(!model.outside(range, x, y, amplitude).is_empty(), correction.outside_span);
        let mut terms: Vec<RangeTerm> = ledger.iter().map(|entry| entry.term).collect();
        terms.dedup();
        prop_assert_eq!(terms.len(), ledger.len(), "each term once, in order");
        prop_assert!(terms.is_sorted());
    }

    #[test]
    fn groups_agree_with_those_of_the_correction(model in models(), range in 0.3..13.0_f64, x in -1.4..1.5_f64) {
        let (amplitude, y) = (200.0, -0.3);
        let correction = model.correction(range, x, y, amplitude);
        let ledger = model.ledger(range, x, y, amplitude, None);
        let of = |group: &str| -> f64 {
            ledger.iter().filter(|entry| entry.term.group() == group).map(|entry| entry.change_m).sum()
        };
        for (group, value) in [
            ("offset", correction.offset_m),
            ("periodic", correction.periodic_m),
            ("position", correction.delay_m),
            ("polynomial", correction.polynomial_m),
            ("amplitude", correction.amplitude_m),
        ] {
            // Sums of at most three numbers below 0.1 m.
            prop_assert!((of(group) + value).abs() < 1e-16, "{}: {} {}", group, of(group), value);
        }
    }
}

#[test]
fn each_reason_of_a_missing_term_is_said() {
    let hyperbola = AmplitudeHyperbola { h1: 0.1, h2: 1e-3, h3: 90.0, amplitude_span: [1.0, 100.0] };
    let shape = FurtherShape {
        surface: Some(SurfaceShape { order: 1, x_span_mm: [-1.0, 1.0], y_span_mm: [-1.0, 1.0] }),
        ..FurtherShape::default()
    };
    let mut model = RangeErrorModel::error_free(INTERVAL_M).with_further(&shape).unwrap();
    (model.hyperbola, model.range_span_m) = (Some(hyperbola), Some([1.0, 4.0]));
    assert_eq!(model.outside(2.0, 0.0, 0.0, 2.0), []);
    assert_eq!(model.outside(5.0, 0.0, 0.0, 2.0), [OutsideModel::Range { range_m: 5.0, span_m: [1.0, 4.0] }]);
    assert!(model.ledger(5.0, 0.0, 0.0, 2.0, Some(0.1)).is_empty(), "no pattern outside the span either");
    assert_eq!(model.outside(2.0, 0.0, 0.0, 0.5), [OutsideModel::Amplitude { amplitude: 0.5, span: [1.0, 100.0] }]);
    // (1 - 2 h1 a) / h3 is negative from a = 5 on, and the linear part too small to make up for it.
    assert_eq!(model.outside(2.0, 0.0, 0.0, 50.0), [OutsideModel::Radicand { amplitude: 50.0 }]);
    assert_eq!(model.outside(2.0, 3.0, 0.0, 2.0), [OutsideModel::ImagePoint { point_mm: [3.0, 0.0] }]);
    assert_eq!(model.outside(2.0, 3.0, 0.0, f64::NAN).len(), 2);
}

#[test]
fn maps_add_up_to_what_the_correction_of_the_frame_did() {
    let (width, height) = (33, 7);
    let format = ImageFormat::new(width, height, [0.1, 0.1]).unwrap();
    let hyperbola = AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 900.0] };
    let terms = RangeTerms { d0: 0.02, periodic: [0.0, 0.0, 0.003, -0.002, 0.01, 0.004], e1: 1e-3, e2: -2e-3 };
    let range_span_m = Some([0.5, 6.0]);
    let model =
        RangeErrorModel { terms, hyperbola: Some(hyperbola), range_span_m, ..RangeErrorModel::error_free(INTERVAL_M) };
    let offset_m = (0..width * height).map(|index| 1e-4 * (index % 11) as f32).collect();
    let pattern = FixedPattern { width, height, offset_m, sigma_m: Vec::new() };
    let mut frame = RangeFrame {
        // Some beyond the span at either end.
        range: Raster::from_fn(width, height, |col, row| 0.2 + 0.2 * col as f32 + 0.01 * row as f32),
        sigma: Raster::filled(width, height, 0.01),
        amplitude: Raster::from_fn(width, height, |col, row| 10.0 + 30.0 * (col + row) as f32),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    frame.range[(5, 5)] = f32::NAN;
    let observed = frame.range.clone();
    let point = [0.02, -0.03];
    let maps = ledger_maps(&observed, &frame.amplitude, &model, &format, point, Some(&pattern)).unwrap();
    let names: Vec<RangeTerm> = maps.iter().map(|(term, _)| *term).collect();
    let expected = [
        RangeTerm::Offset,
        RangeTerm::PeriodicHalfU,
        RangeTerm::PeriodicQuarterU,
        RangeTerm::DelayX,
        RangeTerm::DelayY,
        RangeTerm::Amplitude,
        RangeTerm::Pattern,
    ];
    assert_eq!(names, expected, "the pair of wavelength U is zero and no line");
    let summary = correct_frame(&mut frame, &model, &format, point, Some(&pattern)).unwrap();
    assert!(summary.corrected > 100 && summary.outside_span > 20, "{summary:?}");
    for index in 0..observed.len() {
        let sum: f64 = maps.iter().map(|(_, map)| f64::from(map.as_slice()[index])).sum();
        let change = f64::from(frame.range.as_slice()[index]) - f64::from(observed.as_slice()[index]);
        // Single-precision ranges of up to 6 m are rounded by half a millionth of a metre, before and after.
        assert!((sum - change).abs() < 1e-6 || (sum.is_nan() && change.is_nan()), "{index}: {sum} {change}");
    }
    assert!(ledger_maps(&Raster::filled(3, 3, 1.0), &frame.amplitude, &model, &format, point, None).is_err());
}
