//! Whole frames: corrected, distorted, flagged, counted.

use approx::assert_relative_eq;
use error_models::{
    AmplitudeHyperbola, Error, FixedPattern, FurtherShape, FurtherTerms, PolynomialShape, RangeErrorModel, RangeTerms,
    SurfaceShape, correct_frame, correct_raster, distort_frame,
};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

const WIDTH: usize = 75;
const HEIGHT: usize = 70;
const PRINCIPAL_POINT: [f64; 2] = [0.11, -0.07];

fn model() -> RangeErrorModel {
    RangeErrorModel {
        ambiguity_interval_m: 5.0,
        terms: RangeTerms { d0: 0.024, periodic: [0.01, -0.02, 0.03, 0.01, -0.005, 0.006], e1: 3e-3, e2: -2e-3 },
        hyperbola: Some(AmplitudeHyperbola { h1: 1e-3, h2: 2e-2, h3: 90.0, amplitude_span: [20.0, 900.0] }),
        range_span_m: Some([0.3, 30.0]),
        further: FurtherTerms::default(),
    }
}

fn format() -> ImageFormat {
    ImageFormat::new(WIDTH, HEIGHT, [0.04, 0.05]).unwrap()
}

/// Ranges over six ambiguity intervals.
fn frame() -> RangeFrame {
    let spread = |col: usize, row: usize, period: usize| ((col * 37 + row * 101) % period) as f32 / period as f32;
    RangeFrame {
        range: Raster::from_fn(WIDTH, HEIGHT, |col, row| 0.5 + 29.0 * spread(col, row, 997)),
        sigma: Raster::filled(WIDTH, HEIGHT, 0.01),
        amplitude: Raster::from_fn(WIDTH, HEIGHT, |col, row| 21.0 + 870.0 * spread(col, row, 613)),
        flags: Raster::filled(WIDTH, HEIGHT, Flags::SATURATED),
    }
}

fn pattern() -> FixedPattern {
    let offset_m = (0..WIDTH * HEIGHT).map(|i| (i % 17) as f32 * 1e-3).collect();
    FixedPattern { width: WIDTH, height: HEIGHT, offset_m, sigma_m: Vec::new() }
}

#[test]
fn a_corrected_frame_agrees_with_the_formulas_at_each_pixel() {
    let (model, format, pattern, before) = (model(), format(), pattern(), frame());
    let mut after = before.clone();
    let summary = correct_frame(&mut after, &model, &format, PRINCIPAL_POINT, Some(&pattern)).unwrap();
    for row in 0..HEIGHT {
        for col in 0..WIDTH {
            let [x, y] = format.image_from_pixel([col as f64, row as f64]);
            let range = f64::from(before.range[(col, row)]);
            let amplitude = f64::from(before.amplitude[(col, row)]);
            let correction = model.correction(range, x - PRINCIPAL_POINT[0], y - PRINCIPAL_POINT[1], amplitude);
            assert!(!correction.outside_span);
            let expected = range - correction.total_m() - f64::from(pattern.offset_m[row * WIDTH + col]);
            // Half a unit in the last place of 30 m is 1e-6 m, the phase of 6 intervals is good to 2e-6 rad.
            assert_relative_eq!(f64::from(after.range[(col, row)]), expected, epsilon = 2.5e-6);
            let sigma = 0.01 * (1.0 - correction.range_derivative).abs();
            assert_relative_eq!(f64::from(after.sigma[(col, row)]), sigma, max_relative = 1e-5);
        }
    }
    assert_eq!(after.flags, before.flags);
    assert_eq!((summary.pixels, summary.corrected), (WIDTH * HEIGHT, WIDTH * HEIGHT));
    assert_eq!((summary.outside_span, summary.no_data), (0, 0));
}

#[test]
fn single_precision_is_good_to_a_micrometre_up_to_ten_metres() {
    let format = format();
    let span = PolynomialShape { order: 3, range_span_m: [0.3, 30.0] };
    let surface = Some(SurfaceShape::over_image(3, &format, PRINCIPAL_POINT));
    let shape = FurtherShape { spline_knots: Some(24), polynomial: Some(span), surface };
    let mut further = model().with_further(&shape).unwrap();
    let values: Vec<f64> = (0..further.parameter_count()).map(|i| 5e-3 * (i as f64).sin()).collect();
    further.set_parameter_values(&values).unwrap();
    let mut before = frame();
    before.range.as_mut_slice().iter_mut().for_each(|range| *range *= 1.0 / 3.0);
    for model in [model(), further] {
        let mut after = before.clone();
        correct_frame(&mut after, &model, &format, PRINCIPAL_POINT, None).unwrap();
        let (mut covered, mut largest) = (0, 0.0_f64);
        for (pixel, range) in before.range.as_slice().iter().enumerate() {
            let [x, y] = format.image_from_pixel([(pixel % WIDTH) as f64, (pixel / WIDTH) as f64]);
            let (range, amplitude) = (f64::from(*range), f64::from(before.amplitude.as_slice()[pixel]));
            let correction = model.correction(range, x - PRINCIPAL_POINT[0], y - PRINCIPAL_POINT[1], amplitude);
            covered += usize::from(!correction.outside_span);
            largest = largest.max((f64::from(after.range.as_slice()[pixel]) - range + correction.total_m()).abs());
        }
        // Half a unit in the last place of 8 m to 16 m is 5e-7 m; terms of centimetres are good to some 1e-7 m.
        assert!(covered > WIDTH * HEIGHT * 9 / 10 && largest < 1e-6, "{covered} pixels, {largest:e} m");
    }
}

#[test]
fn the_summary_is_the_ledger_of_the_frame() {
    let (model, format, pattern, before) = (model(), format(), pattern(), frame());
    let mut after = before.clone();
    let summary = correct_frame(&mut after, &model, &format, PRINCIPAL_POINT, Some(&pattern)).unwrap();
    let changes = || {
        let pairs = after.range.as_slice().iter().zip(before.range.as_slice());
        pairs.map(|(after, before)| f64::from(*after) - f64::from(*before))
    };
    // The changes are read off single-precision ranges of up to 30 m (resolution 2e-6 m).
    let largest = changes().fold(0.0_f64, |largest, change| largest.max(change.abs()));
    assert_relative_eq!(summary.total.largest_m, largest, epsilon = 4e-6);
    let mean = changes().sum::<f64>() / (WIDTH * HEIGHT) as f64;
    assert_relative_eq!(summary.total.mean_m, mean, epsilon = 1e-6);
    assert_relative_eq!(summary.offset.mean_m, -0.024);
    assert_relative_eq!(summary.offset.largest_m, 0.024);
    let groups = [summary.offset, summary.periodic, summary.delay, summary.amplitude, summary.pattern];
    let sum: f64 = groups.iter().map(|group| group.mean_m).sum();
    assert_relative_eq!(sum, summary.total.mean_m, epsilon = 1e-7);
    assert!(groups.iter().all(|group| group.largest_m > 1e-3));
    let mean_pattern = pattern.offset_m.iter().map(|o| f64::from(*o)).sum::<f64>() / (WIDTH * HEIGHT) as f64;
    assert_relative_eq!(summary.pattern.mean_m, -mean_pattern, epsilon = 1e-7);
}

#[test]
fn distorting_and_correcting_gives_the_frame_back() {
    let (model, format, pattern, truth) = (model(), format(), pattern(), frame());
    let mut frame = truth.clone();
    let put_on = distort_frame(&mut frame, &model, &format, PRINCIPAL_POINT, Some(&pattern)).unwrap();
    assert!(put_on.total.mean_m > 0.02);
    assert_eq!(put_on.corrected, WIDTH * HEIGHT);
    let taken_off = correct_frame(&mut frame, &model, &format, PRINCIPAL_POINT, Some(&pattern)).unwrap();
    for (range, truth) in frame.range.as_slice().iter().zip(truth.range.as_slice()) {
        // Two roundings to single precision at up to 30 m (half a unit is 1e-6 m) and the phase (see above).
        assert_relative_eq!(range, truth, epsilon = 4e-6);
    }
    for (sigma, truth) in frame.sigma.as_slice().iter().zip(truth.sigma.as_slice()) {
        assert_relative_eq!(sigma, truth, max_relative = 2e-5);
    }
    for (a, b) in [(put_on.total, taken_off.total), (put_on.amplitude, taken_off.amplitude)] {
        assert_relative_eq!(a.mean_m, -b.mean_m, epsilon = 1e-6);
        assert_relative_eq!(a.largest_m, b.largest_m, epsilon = 4e-6);
    }
}

#[test]
fn nothing_is_extrapolated() {
    let (model, format) = (model(), format());
    let mut frame = frame();
    frame.range[(0, 0)] = 0.2; // below the range span
    frame.range[(1, 0)] = 31.0; // above it
    frame.amplitude[(2, 0)] = 19.0; // below the amplitude span
    frame.amplitude[(3, 0)] = f32::NAN; // not known
    frame.range[(4, 0)] = f32::NAN;
    frame.range[(5, 0)] = f32::INFINITY;
    let before = frame.clone();
    let summary = correct_frame(&mut frame, &model, &format, PRINCIPAL_POINT, None).unwrap();
    assert_eq!((summary.corrected, summary.outside_span, summary.no_data), (WIDTH * HEIGHT - 4, 4, 2));
    for col in [0, 1] {
        assert_eq!(frame.range[(col, 0)].to_bits(), before.range[(col, 0)].to_bits());
        assert_eq!(frame.sigma[(col, 0)].to_bits(), before.sigma[(col, 0)].to_bits());
    }
    for col in 0..4 {
        assert_eq!(frame.flags[(col, 0)], Flags::SATURATED | Flags::OUTSIDE_SPAN);
    }
    for col in [2, 3] {
        let [x, y] = format.image_from_pixel([col as f64, 0.0]);
        let range = f64::from(before.range[(col, 0)]);
        let terms = model.terms.correction(5.0, range, x - PRINCIPAL_POINT[0], y - PRINCIPAL_POINT[1]);
        assert_relative_eq!(f64::from(frame.range[(col, 0)]), range - terms, epsilon = 2.5e-6);
    }
    assert!(frame.range[(4, 0)].is_nan() && frame.range[(5, 0)] == f32::INFINITY);
    assert_eq!(frame.flags[(4, 0)], Flags::SATURATED);
}

#[test]
fn the_deviation_of_a_known_offset_is_added_where_it_was_taken_off() {
    let mut sigma_m = vec![0.02; WIDTH * HEIGHT];
    sigma_m[1] = f32::NAN; // not known
    let (bare, known) = (pattern(), FixedPattern { sigma_m, ..pattern() });
    let mut frames = [frame(), frame()];
    for (frame, pattern) in frames.iter_mut().zip([&bare, &known]) {
        frame.range[(2, 0)] = 31.0; // above the range span
        correct_frame(frame, &model(), &format(), PRINCIPAL_POINT, Some(pattern)).unwrap();
    }
    let [without, with] = frames.map(|frame| frame.sigma);
    for (pixel, (without, with)) in without.as_slice().iter().zip(with.as_slice()).enumerate() {
        let expected = if [1, 2].contains(&pixel) { *without } else { without.hypot(0.02) };
        assert_relative_eq!(*with, expected, max_relative = 1e-6);
    }
}

#[test]
fn a_negative_radicand_is_outside_the_span() {
    let hyperbola = AmplitudeHyperbola { h1: 1.0, h2: 0.1, h3: 4.0, amplitude_span: [0.0, 1000.0] };
    assert_eq!(hyperbola.correction(10.0), None);
    let model = RangeErrorModel { hyperbola: Some(hyperbola), ..model() };
    let mut frame = frame();
    frame.amplitude = Raster::filled(WIDTH, HEIGHT, 10.0);
    let summary = correct_frame(&mut frame, &model, &format(), PRINCIPAL_POINT, None).unwrap();
    assert_eq!((summary.outside_span, summary.corrected), (WIDTH * HEIGHT, WIDTH * HEIGHT));
    assert!(summary.amplitude.largest_m.abs() < f64::MIN_POSITIVE);
    let put_on = distort_frame(&mut frame, &model, &format(), PRINCIPAL_POINT, None).unwrap();
    assert_eq!(put_on.outside_span, WIDTH * HEIGHT);
}

#[test]
fn one_frequency_of_several_is_corrected_as_a_raster() {
    let (model, format, frame) = (model(), format(), frame());
    let mut corrected = frame.clone();
    let summary = correct_frame(&mut corrected, &model, &format, PRINCIPAL_POINT, None).unwrap();
    let (mut range, mut flags) = (frame.range, frame.flags);
    let bare = correct_raster(&mut range, &frame.amplitude, &mut flags, &model, &format, PRINCIPAL_POINT).unwrap();
    assert_eq!((range, flags, bare), (corrected.range, corrected.flags, summary));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut frame = frame();
            let put_on = distort_frame(&mut frame, &model(), &format(), PRINCIPAL_POINT, Some(&pattern())).unwrap();
            let off = correct_frame(&mut frame, &model(), &format(), PRINCIPAL_POINT, Some(&pattern())).unwrap();
            (frame, put_on, off)
        })
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn small_and_mismatched_frames_are_answered() {
    let single = ImageFormat::new(1, 1, [0.04; 2]).unwrap();
    let frame_of = |width, height| RangeFrame {
        range: Raster::filled(width, height, 2.0),
        sigma: Raster::filled(width, height, f32::NAN),
        amplitude: Raster::filled(width, height, 100.0),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    let mut one = frame_of(1, 1);
    assert_eq!(correct_frame(&mut one, &model(), &single, [0.0; 2], None).unwrap().corrected, 1);
    let mut row = frame_of(100, 1);
    let format = ImageFormat::new(100, 1, [0.04; 2]).unwrap();
    assert_eq!(correct_frame(&mut row, &model(), &format, [0.0; 2], None).unwrap().corrected, 100);
    assert_eq!(distort_frame(&mut row, &model(), &format, [0.0; 2], None).unwrap().corrected, 100);
    let mut empty = frame_of(0, 0);
    assert!(matches!(correct_frame(&mut empty, &model(), &single, [0.0; 2], None), Err(Error::Image(_))));
    assert!(matches!(correct_frame(&mut row, &model(), &single, [0.0; 2], None), Err(Error::Image(_))));
    let mut ragged = frame_of(1, 1);
    ragged.amplitude = Raster::filled(2, 1, 1.0);
    assert!(matches!(correct_frame(&mut ragged, &model(), &single, [0.0; 2], None), Err(Error::Image(_))));
    assert!(correct_frame(&mut one, &model(), &single, [f64::NAN, 0.0], None).is_err());
    for offset_m in [vec![], vec![f32::NAN]] {
        let pattern = FixedPattern { width: 1, height: 1, offset_m, sigma_m: Vec::new() };
        assert!(correct_frame(&mut one, &model(), &single, [0.0; 2], Some(&pattern)).is_err());
        assert!(distort_frame(&mut one, &model(), &single, [0.0; 2], Some(&pattern)).is_err());
    }
}
