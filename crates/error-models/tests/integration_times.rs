//! Models between two integration times: real, equal to the models at their times, continuous.

use error_models::{
    AmplitudeHyperbola, Error, FurtherShape, ModelSet, PolynomialShape, RangeErrorModel, RangeTerm, RangeTerms,
    correct_frame,
};
use proptest::prelude::*;
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

const INTERVAL_M: f64 = 7.5;

/// A hyperbola by three readable numbers: value at amplitude zero, level at large amplitudes, and slope.
fn hyperbola([height_m, level_m, slope]: [f64; 3], amplitude_span: [f64; 2]) -> AmplitudeHyperbola {
    let h3 = 1.0 / (height_m * height_m);
    let h2 = slope * h3;
    AmplitudeHyperbola { h1: -level_m * h2, h2, h3, amplitude_span }
}

fn model() -> impl Strategy<Value = RangeErrorModel> {
    let terms = (-0.1..0.1_f64, prop::array::uniform6(-0.01..0.01_f64), -0.01..0.01_f64, -0.01..0.01_f64);
    let hyperbola_numbers = (0.01..0.2_f64, -0.02..0.02_f64, 1e-5..1e-2_f64);
    let spans = (10.0..100.0_f64, 500.0..5000.0_f64, 0.2..1.0_f64, 5.0..9.0_f64);
    (terms, hyperbola_numbers, spans).prop_map(|((d0, periodic, e1, e2), (height, level, slope), spans)| {
        RangeErrorModel {
            terms: RangeTerms { d0, periodic, e1, e2 },
            hyperbola: Some(hyperbola([height, level, slope], [spans.0, spans.1])),
            range_span_m: Some([spans.2, spans.3]),
            ..RangeErrorModel::error_free(INTERVAL_M)
        }
    })
}

fn set(models: [RangeErrorModel; 2]) -> ModelSet {
    let [a, b] = models;
    ModelSet { entries: vec![(0.001, vec![a]), (0.016, vec![b])] }
}

fn usable(set: &ModelSet) -> bool {
    let real = |model: &RangeErrorModel| model.hyperbola.is_none_or(|hyperbola| hyperbola.least_radicand() >= 0.0);
    set.validate().is_ok() && set.entries.iter().all(|(_, models)| models.iter().all(real))
}

#[test]
fn prepared_corrections_have_the_bits_of_whole_frames() {
    use error_models::{FixedPattern, FrameRows};
    use std::sync::Arc;
    let (width, height) = (70, 21);
    let terms = RangeTerms { d0: 0.01, periodic: [0.004, -0.003, 0.002, 0.001, -0.002, 0.003], e1: 5e-4, e2: -3e-4 };
    let shorter = RangeErrorModel {
        terms,
        hyperbola: Some(hyperbola([0.05, 0.01, 1e-3], [20.0, 900.0])),
        range_span_m: Some([0.5, 7.0]),
        ..RangeErrorModel::error_free(INTERVAL_M)
    };
    let longer = RangeErrorModel { terms: RangeTerms { d0: 0.03, ..terms }, ..shorter.clone() };
    let set = set([shorter, longer]);
    let format = ImageFormat::new(width, height, [0.04, 0.04]).unwrap();
    let value = |col: usize, row: usize| 0.3 + 0.1 * ((col * 7 + row * 13) % 73) as f32;
    let frame = RangeFrame {
        sigma: Raster::from_fn(width, height, |col, _| 0.001 * (1 + col) as f32),
        amplitude: Raster::from_fn(width, height, |col, row| 15.0 * value(col, row)),
        ..RangeFrame::from_range(Raster::from_fn(width, height, value))
    };
    let offset_m = (0..width * height).map(|pixel| 1e-4 * (pixel % 17) as f32).collect();
    let sigma_m = (0..width * height).map(|pixel| if pixel % 5 == 0 { f32::NAN } else { 1e-4 }).collect();
    let pattern = FixedPattern { width, height, offset_m, sigma_m };
    for time_s in [0.001, 0.004] {
        let mut model = set.at(time_s).unwrap().remove(0);
        let mut prepared = model.prepare(&format, [0.1, -0.2], Some(Arc::new(pattern.clone()))).unwrap();
        model.add_offset(0.005);
        prepared.set_drift(0.005);
        let (mut whole, mut rows) = (frame.clone(), frame.clone());
        model.correct_frame(&mut whole, &format, [0.1, -0.2], Some(&pattern)).unwrap();
        for (first, count) in [(0, 1), (1, 8), (9, 12)] {
            let at = first * width..(first + count) * width;
            let part = FrameRows {
                range: &mut rows.range.as_mut_slice()[at.clone()],
                sigma: &mut rows.sigma.as_mut_slice()[at.clone()],
                amplitude: &rows.amplitude.as_slice()[at.clone()],
                flags: &mut rows.flags.as_mut_slice()[at],
            };
            prepared.correct_rows(first, part).unwrap();
        }
        assert_eq!(whole.range, rows.range, "{time_s} s");
        assert_eq!(whole.sigma, rows.sigma, "{time_s} s");
        assert_eq!(whole.flags, rows.flags, "{time_s} s");
        assert!(rows.flags.as_slice().iter().any(|flags| flags.contains(Flags::OUTSIDE_SPAN)));
        let mut beyond = frame.clone();
        let part = FrameRows {
            range: beyond.range.as_mut_slice(),
            sigma: beyond.sigma.as_mut_slice(),
            amplitude: frame.amplitude.as_slice(),
            flags: beyond.flags.as_mut_slice(),
        };
        assert!(prepared.correct_rows(1, part).is_err(), "beyond the last row");
        assert_eq!(beyond.range, frame.range);
    }
}

proptest! {
    #[test]
    fn values_between_are_real_and_continuous(
        models in prop::array::uniform2(model()),
        share in 1e-3..0.999_f64,
        [range_share, amplitude_share, x, y] in prop::array::uniform4(0.0..1.0_f64),
    ) {
        let set = set(models.clone());
        prop_assume!(usable(&set));
        let [ranges, amplitudes] = [
            [models[0].range_span_m.unwrap(), models[1].range_span_m.unwrap()],
            [models[0].hyperbola.unwrap().amplitude_span, models[1].hyperbola.unwrap().amplitude_span],
        ].map(|[a, b]| [a[0].max(b[0]), a[1].min(b[1])]);
        let range_m = ranges[0] + range_share * (ranges[1] - ranges[0]);
        let amplitude = amplitudes[0] + amplitude_share * (amplitudes[1] - amplitudes[0]);
        let at = |time_s: f64| set.at(time_s).unwrap()[0].correction(range_m, x, y, amplitude);
        let time_s = |share: f64| 0.001 * 16.0_f64.powf(share);
        let found = at(time_s(share));
        prop_assert!(found.total_m().is_finite() && !found.outside_span);
        // Linear in the logarithm of the time.
        let [short, long] = [0, 1].map(|index| models[index].correction(range_m, x, y, amplitude).total_m());
        let expected = (1.0 - share) * short + share * long;
        prop_assert!((found.total_m() - expected).abs() < 1e-12, "{} instead of {expected}", found.total_m());
        let parts = set.at(time_s(share)).unwrap()[0].ledger(range_m, x, y, amplitude, None);
        let sum: f64 = parts.iter().map(|part| part.change_m).sum();
        prop_assert!((sum + found.total_m()).abs() < 1e-12, "the parts add up to {sum}");
        // A drift is a part of its own, and the camera shows what correction takes off again.
        let mut drifted = set.at(time_s(share)).unwrap().remove(0);
        drifted.add_offset(0.03);
        let with_drift = drifted.correction(range_m, x, y, amplitude).total_m();
        prop_assert!((with_drift - found.total_m() - 0.03).abs() < 1e-15);
        let parts = drifted.ledger(range_m, x, y, amplitude, None);
        let of_drift: Vec<f64> =
            parts.iter().filter(|part| part.term == RangeTerm::WarmUp).map(|part| part.change_m).collect();
        prop_assert_eq!(of_drift, vec![-0.03]);
        prop_assert!((parts.iter().map(|part| part.change_m).sum::<f64>() + with_drift).abs() < 1e-12);
        let edge = 0.4;
        if range_m > ranges[0] + edge && range_m < ranges[1] - edge {
            let shown = drifted.observed_range(range_m - with_drift, x, y, amplitude).unwrap();
            // The solver stops at four units in the last place; slopes of the terms stay below 0.9.
            prop_assert!((shown - range_m).abs() < 1e-13, "{shown} instead of {range_m}");
        }
        // At the models' own times, and close to them.
        prop_assert_eq!(at(0.001), models[0].correction(range_m, x, y, amplitude));
        prop_assert_eq!(at(0.016), models[1].correction(range_m, x, y, amplitude));
        let step = 1e-5;
        prop_assert!((at(time_s(step)).total_m() - short).abs() <= 1.01 * step * (long - short).abs() + 1e-14);
        prop_assert!((at(time_s(1.0 - step)).total_m() - long).abs() <= 1.01 * step * (long - short).abs() + 1e-14);
    }

    #[test]
    fn frames_are_corrected_as_single_pixels_are(models in prop::array::uniform2(model()), share in 0.01..0.99_f64) {
        let set = set(models);
        prop_assume!(usable(&set));
        let model = &mut set.at(0.001 * 16.0_f64.powf(share)).unwrap()[0];
        model.add_offset(0.02);
        let format = ImageFormat::new(40, 3, [0.04, 0.04]).unwrap();
        let mut frame = RangeFrame {
            range: Raster::from_fn(40, 3, |col, row| 0.1 + 0.25 * col as f32 + 0.01 * row as f32),
            sigma: Raster::filled(40, 3, 0.01),
            amplitude: Raster::from_fn(40, 3, |col, row| 5.0 + 100.0 * col as f32 + 7.0 * row as f32),
            flags: Raster::filled(40, 3, Flags::empty()),
        };
        let before = frame.clone();
        let summary = model.correct_frame(&mut frame, &format, [0.0, 0.0], None).unwrap();
        let mut outside = 0;
        for row in 0..3 {
            for col in 0..40 {
                let pixel = (col, row);
                let [x, y] = format.image_from_pixel([col as f64, row as f64]);
                let range_m = f64::from(before.range[pixel]);
                let correction = model.correction(range_m, x, y, f64::from(before.amplitude[pixel]));
                // Single precision: two units in the last place of 10 m, and a millionth of the coefficients.
                prop_assert!((f64::from(frame.range[pixel]) - (range_m - correction.total_m())).abs() < 3e-6);
                let sigma = 0.01 * (1.0 - correction.range_derivative);
                let corrected = before.range[pixel].to_bits() != frame.range[pixel].to_bits();
                prop_assert!(!corrected || (f64::from(frame.sigma[pixel]) - sigma).abs() < 1e-6);
                prop_assert_eq!(frame.flags[pixel].contains(Flags::OUTSIDE_SPAN), correction.outside_span);
                outside += usize::from(correction.outside_span);
            }
        }
        prop_assert_eq!(summary.outside_span, outside);
    }
}

#[test]
fn coefficients_interpolate_where_all_terms_are_linear() {
    let with = |d0: f64, sine: f64| RangeErrorModel {
        terms: RangeTerms { d0, periodic: [sine, 0.0, 0.0, 0.0, 0.0, 0.0], ..RangeTerms::default() },
        ..RangeErrorModel::error_free(INTERVAL_M)
    };
    // The geometric mean of the times has the arithmetic mean of the coefficients.
    let model = &set([with(0.01, 0.004), with(0.03, -0.002)]).at(0.004).unwrap()[0];
    let expected = with(0.02, 0.001);
    for step in 0..40 {
        let range_m = 0.2 * f64::from(step);
        let found = model.correction(range_m, 0.0, 0.0, f64::NAN).total_m();
        assert!((found - expected.correction(range_m, 0.0, 0.0, f64::NAN).total_m()).abs() < 1e-15);
    }
    let mut drifted = model.clone();
    drifted.add_offset(0.005);
    assert!((drifted.correction(1.0, 0.0, 0.0, 1.0).offset_m - 0.025).abs() < 1e-15);
}

#[test]
fn what_has_nothing_between_is_refused_by_name() {
    let plain = RangeErrorModel::error_free(INTERVAL_M);
    let with_hyperbola =
        |span| RangeErrorModel { hyperbola: Some(hyperbola([0.05, 0.0, 1e-3], span)), ..plain.clone() };
    let polynomial = PolynomialShape { order: 2, range_span_m: [0.5, 6.0] };
    let shape = FurtherShape { polynomial: Some(polynomial), ..FurtherShape::default() };
    let refused = |models| set(models).at(0.004).unwrap_err();
    assert!(matches!(
        refused([plain.clone(), with_hyperbola([10.0, 100.0])]),
        Error::DifferentKinds { term: "hyperbola", .. }
    ));
    assert!(matches!(
        refused([plain.clone().with_further(&shape).unwrap(), plain.clone()]),
        Error::DifferentKinds { term: "polynomial", .. }
    ));
    assert!(matches!(
        refused([with_hyperbola([10.0, 100.0]), with_hyperbola([200.0, 900.0])]),
        Error::NoCommonSpan { span: "amplitudes", .. }
    ));
    assert!(matches!(
        refused([plain.clone(), RangeErrorModel::error_free(5.0)]),
        Error::OutOfDomain { name: "ambiguity_interval_m", .. }
    ));
    // The value 0.1 m at amplitude zero and the level 0.5 m at large ones have no branch of one hyperbola between.
    let broken = RangeErrorModel { hyperbola: Some(hyperbola([0.1, -0.5, 1e-3], [1.0, 1000.0])), ..plain.clone() };
    assert!(broken.hyperbola.unwrap().least_radicand() < 0.0);
    assert!(matches!(
        refused([with_hyperbola([10.0, 100.0]), broken]),
        Error::OutOfDomain { name: "radicand of the hyperbola", .. }
    ));
    let set = set([plain.clone(), plain]);
    for outside in [0.0009, 0.017, f64::NAN] {
        assert!(matches!(set.at(outside).unwrap_err(), Error::NoModelForIntegrationTime { .. }));
    }
}

#[test]
fn a_models_own_time_gives_its_own_bits() {
    let model = RangeErrorModel {
        terms: RangeTerms { d0: 0.02, periodic: [0.004, 0.0, 0.001, 0.0, 0.0, 0.002], ..RangeTerms::default() },
        ..RangeErrorModel::error_free(INTERVAL_M)
    };
    let set = set([model.clone(), RangeErrorModel::error_free(INTERVAL_M)]);
    let format = ImageFormat::new(8, 2, [0.04, 0.04]).unwrap();
    let frame = RangeFrame {
        range: Raster::from_fn(8, 2, |col, row| 1.0 + 0.3 * (col + 8 * row) as f32),
        sigma: Raster::filled(8, 2, 0.01),
        amplitude: Raster::filled(8, 2, 100.0),
        flags: Raster::filled(8, 2, Flags::empty()),
    };
    let (mut plain, mut interpolated) = (frame.clone(), frame);
    correct_frame(&mut plain, &model, &format, [0.0, 0.0], None).unwrap();
    set.at(0.001).unwrap()[0].correct_frame(&mut interpolated, &format, [0.0, 0.0], None).unwrap();
    assert_eq!(plain, interpolated);
}
