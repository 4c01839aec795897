//! Frequencies that contradict each other.

use crate::common::{CONTRAST, NO_SYSTEMATICS, THREE, frame, matched_range, modulations, spread};
use multipath::{
    DetectionOptions, Detector, Error, Evidence, FrequencyResponse, Systematics, detect, estimate_response,
};
use range_image::{ComplexFrame, Flags, Raster};

const SIZE: [usize; 2] = [100, 80];

fn response() -> FrequencyResponse {
    FrequencyResponse { contrast: CONTRAST.to_vec() }
}

fn options(evidence: Evidence, false_alarm: f64) -> DetectionOptions {
    DetectionOptions { false_alarm, evidence, systematics: NO_SYSTEMATICS }
}

/// One path of 1 to 6 m, of an amplitude of 50 to 250 standard deviations.
fn single(index: usize) -> Vec<(f64, f64)> {
    vec![(100.0 + 400.0 * spread(index, 1), 1.0 + 5.0 * spread(index, 2))]
}

fn truth(paths: impl Fn(usize) -> Vec<(f64, f64)>) -> Raster<f32> {
    Raster::from_fn(SIZE[0], SIZE[1], |col, row| paths(row * SIZE[0] + col)[0].1 as f32)
}

#[test]
fn one_path_is_flagged_as_often_as_stated() {
    for evidence in [Evidence::Ranges, Evidence::RangesAndAmplitudes] {
        for (frequencies, contrast) in [(&THREE[..2], &CONTRAST[..2]), (&THREE, &CONTRAST)] {
            let mut frame = frame(SIZE, frequencies, contrast, 2.0, 11, single);
            let response = FrequencyResponse { contrast: contrast.to_vec() };
            let found = detect(&mut frame, &truth(single), &response, &options(evidence, 0.02)).unwrap();
            assert_eq!(found.tested, SIZE[0] * SIZE[1]);
            let share = found.flagged as f64 / found.tested as f64;
            // 8000 pixels: standard deviation 0.0016 of a share of 0.02; four of them.
            assert!((share - 0.02).abs() < 0.0064, "{evidence:?}, {} frequencies: {share}", frequencies.len());
            let mean = found.statistic.as_slice().iter().map(|s| f64::from(*s)).sum::<f64>() / found.tested as f64;
            let freedom = f64::from(found.freedom.as_slice()[0]);
            // The mean of chi-squared is its freedom, with deviation sqrt(2 freedom / 8000); four of them.
            assert!((mean - freedom).abs() < 4.0 * (2.0 * freedom / 8000.0).sqrt(), "{mean} for {freedom}");
        }
    }
}

#[test]
fn a_second_path_is_found() {
    // A second path of a tenth to a half of the light, 0.6 to 2.5 m longer.
    let paths = |index: usize| {
        let (amplitude, range) = single(index)[0];
        let ratio = 0.1 + 0.4 * spread(index, 3);
        vec![(amplitude, range), (ratio * amplitude, range + 0.6 + 1.9 * spread(index, 4))]
    };
    let mut frame = frame(SIZE, &THREE, &CONTRAST, 2.0, 12, paths);
    let range = matched_range(&frame, &CONTRAST, 8.0);
    let found = detect(&mut frame, &range, &response(), &DetectionOptions::default()).unwrap();
    let share = found.flagged as f64 / found.tested as f64;
    // What is left are weak second paths whose detour is near the interval of one frequency, at the least amplitude.
    assert!(share > 0.97, "{share}");
    let flags = frame.flags.as_slice().iter().filter(|flags| flags.contains(Flags::MULTIPATH)).count();
    assert_eq!(flags, found.flagged);
}

#[test]
fn a_floor_keeps_systematic_errors_from_being_multipath() {
    // Ranges of the frequencies off by up to 4 mm and contrast by 2 %, at an amplitude that shows it.
    let mut shifted = frame(SIZE, &THREE, &[1.0, 0.8 * 1.02, 0.6 * 0.98], 0.2, 13, single);
    for (channel, shift_m) in shifted.channels.iter_mut().zip([0.004, -0.003, 0.002]) {
        let (sin, cos) = channel.modulation.phase_from_range(shift_m).sin_cos();
        let turned = |i: usize| {
            let (re, im) = (f64::from(channel.real.as_slice()[i]), f64::from(channel.imaginary.as_slice()[i]));
            ((re * cos - im * sin) as f32, (re * sin + im * cos) as f32)
        };
        let values: Vec<(f32, f32)> = (0..SIZE[0] * SIZE[1]).map(turned).collect();
        channel.real = Raster::from_vec(SIZE[0], SIZE[1], values.iter().map(|v| v.0).collect()).unwrap();
        channel.imaginary = Raster::from_vec(SIZE[0], SIZE[1], values.iter().map(|v| v.1).collect()).unwrap();
    }
    let count = |systematics: Systematics| {
        let options = DetectionOptions { systematics, ..DetectionOptions::default() };
        detect(&mut shifted.clone(), &truth(single), &response(), &options).unwrap().flagged
    };
    assert!(count(NO_SYSTEMATICS) > SIZE[0] * SIZE[1] * 9 / 10);
    assert_eq!(count(Systematics { floor_m: 0.004, floor_contrast: 0.02 }), 0);
}

#[test]
fn the_response_is_the_median_ratio_whatever_a_quarter_of_the_frame_says() {
    let paths = |index: usize| {
        let (amplitude, range) = single(index)[0];
        let second = if index.is_multiple_of(4) { 0.4 * amplitude } else { 0.0 };
        vec![(amplitude, range), (second, range + 0.3 + 2.0 * spread(index, 5))]
    };
    let frame = frame(SIZE, &THREE, &CONTRAST, 2.0, 14, paths);
    let estimate = estimate_response(&frame, 10.0).unwrap();
    assert_eq!(estimate.pixels, SIZE[0] * SIZE[1]);
    for (found, expected) in estimate.response.contrast.iter().zip(CONTRAST) {
        // A quarter of outliers, most of them to one side, moves a median by less than half the spread of 1 to 2 %.
        assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
    }
    assert!(estimate.spread[2] > 0.002 && estimate.spread[2] < 0.05, "{:?}", estimate.spread);
}

#[test]
fn what_cannot_be_tested_is_not() {
    let mut frame = frame([6, 1], &THREE, &CONTRAST, 2.0, 15, |_| vec![(200.0, 2.0)]);
    frame.channels[0].real.as_mut_slice()[0] = f32::NAN;
    frame.channels[1].sigma.as_mut_slice()[0] = f32::NAN;
    frame.flags.as_mut_slice()[1] = Flags::SATURATED;
    frame.flags.as_mut_slice()[2] = Flags::MIXED_PIXEL;
    for channel in &mut frame.channels {
        channel.real.as_mut_slice()[3] = 0.0;
        channel.imaginary.as_mut_slice()[3] = 0.0;
    }
    let mut range = Raster::filled(6, 1, 2.0);
    range.as_mut_slice()[4] = f32::NAN;
    let found = detect(&mut frame, &range, &response(), &DetectionOptions::default()).unwrap();
    assert_eq!(found.freedom.as_slice(), [0, 0, 0, 0, 0, 4]);
    assert_eq!(found.tested, 1);
    assert!(found.statistic.as_slice()[..5].iter().all(|s| s.is_nan()));
    // Two of three frequencies are still a test.
    frame.channels[2].real.as_mut_slice()[5] = f32::NAN;
    let found = detect(&mut frame, &range, &response(), &DetectionOptions::default()).unwrap();
    assert_eq!(found.freedom.as_slice()[5], 2);
}

#[test]
fn a_channel_without_sigma_is_named() {
    let mut frame = frame([6, 1], &THREE, &CONTRAST, 2.0, 15, |_| vec![(200.0, 2.0)]);
    frame.channels[1].sigma.as_mut_slice().fill(f32::NAN);
    let range = Raster::filled(6, 1, 2.0);
    let error = detect(&mut frame, &range, &response(), &DetectionOptions::default()).unwrap_err();
    assert_eq!(error, multipath::Error::SigmaUnknown { channel: 1 });
    let error = multipath::solve_two_paths(&frame, &response(), &multipath::TwoPathOptions::default()).unwrap_err();
    assert!(error.to_string().contains("with_sigma"), "{error}");
    frame.channels[1].real.as_mut_slice().fill(f32::NAN);
    assert!(detect(&mut frame, &range, &response(), &DetectionOptions::default()).is_ok());
}

#[test]
fn neither_noise_nor_floor_is_no_test() {
    let mut frame = frame([2, 2], &THREE, &CONTRAST, 0.0, 15, |_| vec![(200.0, 2.0)]);
    let options = options(Evidence::RangesAndAmplitudes, 1e-3);
    let found = detect(&mut frame, &Raster::filled(2, 2, 2.0), &response(), &options).unwrap();
    assert_eq!(found.tested, 0);
}

#[test]
fn bad_input_is_refused_by_name() {
    let range = Raster::filled(4, 1, 2.0);
    let good = |f: &[f64]| frame([4, 1], f, &vec![1.0; f.len()], 1.0, 1, |_| vec![(100.0, 2.0)]);
    let run = |mut frame: ComplexFrame, contrast: Vec<f64>, options: DetectionOptions| {
        detect(&mut frame, &range, &FrequencyResponse { contrast }, &options).unwrap_err()
    };
    let default = DetectionOptions::default();
    assert!(matches!(run(good(&[20e6]), vec![1.0], default), Error::FrequencyCount { found: 1, .. }));
    assert!(matches!(
        run(good(&[2e7, 5e7, 2e7]), vec![1.0; 3], default),
        Error::RepeatedFrequency { first: 0, second: 2, .. }
    ));
    assert!(matches!(run(good(&[2e7, 5e7]), vec![1.0], default), Error::Count { found: 1, expected: 2, .. }));
    assert!(matches!(run(good(&[2e7, 5e7]), vec![1.0, 0.0], default), Error::OutOfDomain { name: "contrast", .. }));
    let options = DetectionOptions { false_alarm: 0.0, ..default };
    assert!(matches!(run(good(&[2e7, 5e7]), vec![1.0; 2], options), Error::OutOfDomain { name: "false_alarm", .. }));
    let mut other_size = good(&[2e7, 5e7]);
    assert!(matches!(
        detect(&mut other_size, &Raster::filled(3, 1, 2.0), &FrequencyResponse::flat(2), &default),
        Err(Error::Image(_))
    ));
    let mut empty = ComplexFrame { flags: Raster::default(), channels: good(&[2e7, 5e7]).channels };
    assert!(detect(&mut empty, &range, &FrequencyResponse::flat(2), &default).is_err());
    let mut detector = Detector::new(&modulations(&[2e7, 5e7]), &FrequencyResponse::flat(2), &default).unwrap();
    let mut other = good(&[2e7, 6e7]);
    let error = detector.detect_into(&mut other, &range, &mut multipath::Detection::default()).unwrap_err();
    assert!(matches!(error, Error::OtherFrequency { channel: 1, .. }));
    assert!(matches!(estimate_response(&good(&[2e7, 5e7]), 1.0), Err(Error::TooFewPixels { found: 4, .. })));
}
