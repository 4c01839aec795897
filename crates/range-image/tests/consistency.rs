//! The check of samples against each other: false alarms, motion, saturation.

use std::f64::consts::TAU;

use crate::common::{Truth, modulations};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use range_image::{
    ConsistencyOptions, ConsistencySummary, DemodulationOptions, Error, Flags, NoiseModel, OffsetRule, Raster,
    RawFrame, RulesVerdict, SampleCheck, Samples, SaturationVerdict, check_samples,
};

const NOISE: NoiseModel = NoiseModel { shot_variance_per_unit: 0.8, dark_sigma: 4.0 };

fn demodulation() -> DemodulationOptions {
    DemodulationOptions { noise: NOISE, ..DemodulationOptions::default() }
}

/// Noisy samples of pixels whose truth may differ from step to step.
fn noisy(pixels: usize, steps: usize, seed: u64, truth: impl Fn(usize, usize) -> Truth) -> Vec<f32> {
    let mut generator = Pcg64Mcg::seed_from_u64(seed);
    let mut values = Vec::with_capacity(steps * pixels);
    for step in 0..steps {
        for pixel in 0..pixels {
            let sample = truth(pixel, step).sample(step, steps);
            let variance = NOISE.shot_variance_per_unit * sample.max(0.0) + NOISE.dark_sigma.powi(2);
            let deviation: f64 = StandardNormal.sample(&mut generator);
            values.push((sample + variance.sqrt() * deviation) as f32);
        }
    }
    values
}

fn frame(pixels: usize, steps: usize, samples: Samples) -> RawFrame {
    RawFrame::new(pixels, 1, steps, modulations(1), samples).unwrap()
}

fn check(
    raw: &RawFrame,
    demodulation: &DemodulationOptions,
    options: &ConsistencyOptions,
) -> (ConsistencySummary, Vec<Flags>) {
    let mut flags = Raster::filled(raw.width(), raw.height(), Flags::empty());
    let summary = check_samples(raw, demodulation, options, &mut flags).unwrap();
    (summary, flags.into_vec())
}

fn inconsistent(summary: &ConsistencySummary) -> usize {
    match summary.rules {
        RulesVerdict::Checked { inconsistent, .. } => inconsistent,
        RulesVerdict::NothingToCheck => panic!("nothing to check"),
    }
}

#[test]
fn noise_alone_is_flagged_as_rarely_as_stated() {
    let pixels = 100_000;
    for (steps, depth) in [(4, 0.9), (5, 0.6), (6, 0.9), (8, 0.9), (12, 0.5)] {
        let at_rest =
            |pixel: usize, _| Truth { phase: TAU * pixel as f64 / 977.0, amplitude: depth * 800.0, offset: 800.0 };
        let raw = frame(pixels, steps, Samples::F32(noisy(pixels, steps, steps as u64, at_rest)));
        for probability in [0.1, 0.01, 1e-3] {
            let options = ConsistencyOptions { false_alarm_probability: probability, ..ConsistencyOptions::default() };
            let (summary, flags) = check(&raw, &demodulation(), &options);
            let expected = probability * pixels as f64;
            let found = inconsistent(&summary) as f64;
            // Four binomial deviations, and 10 % for the distribution that stands in where samples differ in variance.
            let allowed = 4.0 * (expected * (1.0 - probability)).sqrt() + if steps > 4 { 0.1 * expected } else { 0.0 };
            assert!((found - expected).abs() < allowed, "{steps} steps, {probability}: {found} of {expected}");
            assert_eq!(flags.iter().filter(|flags| **flags == Flags::MOTION).count(), inconsistent(&summary));
            assert_eq!(summary.saturation, SaturationVerdict::NotFound);
        }
    }
}

#[test]
fn degrees_of_freedom_are_the_samples_beside_what_is_known() {
    let degrees = |steps, harmonics: &[usize], offset| {
        let options = ConsistencyOptions { harmonics: harmonics.to_vec(), offset, ..ConsistencyOptions::default() };
        SampleCheck::new(steps, &demodulation(), &options).unwrap().degrees_of_freedom()
    };
    for steps in 3..13 {
        assert_eq!(degrees(steps, &[], OffsetRule::Free), steps - 3);
        assert_eq!(degrees(steps, &[], OffsetRule::Zero), steps - 2);
    }
    assert_eq!(degrees(8, &[2], OffsetRule::Free), 3);
    assert_eq!(degrees(8, &[2, 3], OffsetRule::Free), 1);
    // Harmonics 3 and 5 fall onto the fundamental of four samples, 2 and 6 onto the one rule that there is.
    assert_eq!(degrees(4, &[3, 5], OffsetRule::Free), 1);
    assert_eq!(degrees(4, &[6], OffsetRule::Free), 0);
}

#[test]
fn three_samples_leave_nothing_to_check() {
    let raw = frame(4, 3, Samples::U16(vec![1, 500, 7, 0, 800, 3, 900, 0, 20, 10, 30, 0]));
    let (summary, flags) = check(&raw, &DemodulationOptions::default(), &ConsistencyOptions::default());
    assert_eq!(summary.rules, RulesVerdict::NothingToCheck);
    assert!(flags.iter().all(Flags::is_empty));
    let options = ConsistencyOptions { harmonics: vec![2], ..ConsistencyOptions::default() };
    let raw = frame(1, 4, Samples::U16(vec![1, 500, 7, 0]));
    assert_eq!(check(&raw, &DemodulationOptions::default(), &options).0.rules, RulesVerdict::NothingToCheck);
}

/// Part of the pixels that are flagged when the phase drifts by `drift` from the first to the last sample.
fn detection_rate(steps: usize, drift: f64, phase: f64) -> f64 {
    let pixels = 4000;
    let moving = |_, step: usize| Truth {
        phase: phase + drift * step as f64 / (steps - 1) as f64,
        amplitude: 300.0,
        offset: 500.0,
    };
    let raw = frame(pixels, steps, Samples::F32(noisy(pixels, steps, 5, moving)));
    let options = ConsistencyOptions { false_alarm_probability: 1e-3, ..ConsistencyOptions::default() };
    inconsistent(&check(&raw, &demodulation(), &options).0) as f64 / pixels as f64
}

#[test]
fn motion_is_detected_the_better_the_larger_it_is() {
    // Four samples at phase 135 degrees, where the rule sees most. To second order in the drift the part beside the
    // fundamental is A (sqrt 2 drift / 3 + sqrt 2 drift^2 / 18), against a deviation of 20.4 and a limit of 3.29 of them.
    let at_limit = 0.442;
    let mean = 300.0 * 2.0_f64.sqrt() * (at_limit / 3.0 + at_limit * at_limit / 18.0);
    assert!((mean / (0.8 * 500.0 + 16.0_f64).sqrt() - 3.29).abs() < 0.05);
    let rates = [0.0, 0.25, at_limit, 0.8].map(|drift| detection_rate(4, drift, 0.375 * TAU));
    assert!(rates[0] < 0.004, "{rates:?}");
    // Half of the pixels; 4000 of them give 0.8 %, the third order a tenth of a deviation, which is 4 %.
    assert!((rates[2] - 0.5).abs() < 0.07, "{rates:?}");
    assert!(rates[1] < 0.2 && rates[3] > 0.95, "{rates:?}");
    // And none where the one rule is blind.
    assert!(detection_rate(4, 0.3, 0.125 * TAU) < 0.01);
    // Eight samples see at every phase: 7.8 deviations at the least, against a limit of 4.5.
    for phase in [0.125, 0.375, 0.6, 0.9] {
        assert!(detection_rate(8, 1.6, phase * TAU) > 0.95);
    }
}

#[test]
fn an_edge_that_passes_is_motion() {
    // From the third sample on the pixels see the dark background.
    let passing = |pixel: usize, step: usize| {
        let near = Truth { phase: 1.0, amplitude: 400.0, offset: 900.0 };
        let far = Truth { phase: 2.5, amplitude: 60.0, offset: 200.0 };
        if (100..140).contains(&pixel) && step > 1 { far } else { near }
    };
    let raw = frame(300, 4, Samples::F32(noisy(300, 4, 10, passing)));
    let (summary, flags) = check(&raw, &demodulation(), &ConsistencyOptions::default());
    assert_eq!(inconsistent(&summary), 40);
    assert!((0..300).all(|pixel| flags[pixel].contains(Flags::MOTION) == (100..140).contains(&pixel)));
}

#[test]
fn known_harmonics_and_the_tolerance_are_let_pass() {
    let pixels = 20_000;
    let mut values = noisy(pixels, 8, 3, |pixel, _| Truth { phase: pixel as f64, amplitude: 400.0, offset: 600.0 });
    for step in 0..8 {
        for pixel in 0..pixels {
            let angle = pixel as f64 + TAU * step as f64 / 8.0;
            values[step * pixels + pixel] += (40.0 * (2.0 * angle).cos()) as f32;
        }
    }
    let raw = frame(pixels, 8, Samples::F32(values));
    let found = |harmonics: &[usize], tolerance| {
        let harmonics = harmonics.to_vec();
        let options =
            ConsistencyOptions { false_alarm_probability: 0.01, harmonics, tolerance, ..ConsistencyOptions::default() };
        inconsistent(&check(&raw, &demodulation(), &options).0) as f64 / pixels as f64
    };
    // A tenth of the amplitude, 80 in length, against a deviation of 22.3 in each of five dimensions.
    assert!(found(&[], 0.0) > 0.5);
    // 20,000 pixels: 0.07 %, four times that.
    assert!((found(&[2], 0.0) - 0.01).abs() < 0.003);
    assert!(found(&[], 0.1) < 0.01);
}

#[test]
fn differences_of_taps_with_and_without_an_offset() {
    // S0 + S2 = 20 as S1 + S3: an offset of 10 that no tap difference should have.
    let raw = frame(1, 4, Samples::I16(vec![310, 110, -290, -90]));
    let free = check(&raw, &demodulation(), &ConsistencyOptions::default());
    assert_eq!(inconsistent(&free.0), 0);
    // Its length is 10 sqrt(4) against a dark deviation of 4: 25 against a limit of 18.4 for two dimensions.
    let zero = ConsistencyOptions { offset: OffsetRule::Zero, ..ConsistencyOptions::default() };
    assert_eq!(inconsistent(&check(&raw, &demodulation(), &zero).0), 1);
    let raw = frame(1, 4, Samples::I16(vec![300, 100, -300, -100]));
    assert_eq!(inconsistent(&check(&raw, &demodulation(), &zero).0), 0);
    // Three samples have a rule then: their sum.
    let raw = frame(2, 3, Samples::I16(vec![200, 200, -100, -70, -100, -70]));
    let (summary, flags) = check(&raw, &demodulation(), &zero);
    assert_eq!(inconsistent(&summary), 1);
    assert_eq!(flags, [Flags::empty(), Flags::MOTION]);
}

/// A scene with a bright spot, in counts, cut off at `full`.
fn bright_spot(full: f64) -> (RawFrame, Vec<bool>) {
    let (width, height) = (80, 60);
    let mut cut = vec![false; width * height];
    let truth = |pixel: usize, _: usize| {
        let (col, row) = ((pixel % width) as f64 - 40.0, (pixel / width) as f64 - 30.0);
        let light = 300.0 + 5000.0 * (-(col * col + row * row) / 50.0).exp();
        Truth { phase: 0.1 * col, amplitude: 0.6 * light, offset: light }
    };
    let values = noisy(width * height, 4, 8, truth);
    let samples = values.iter().enumerate().map(|(index, &value)| {
        cut[index % (width * height)] |= f64::from(value).round() >= full;
        f64::from(value).round().clamp(0.0, full) as u16
    });
    let samples = Samples::U16(samples.collect());
    (RawFrame::new(width, height, 4, modulations(1), samples).unwrap(), cut)
}

#[test]
fn a_saturation_that_was_not_stated_is_found() {
    let (raw, cut) = bright_spot(4095.0);
    let (summary, flags) = check(&raw, &demodulation(), &ConsistencyOptions::default());
    assert_eq!(summary.saturation, SaturationVerdict::Plateau { highest: Some(4095.0), lowest: None });
    assert_eq!(summary.saturated, cut.iter().filter(|cut| **cut).count());
    for (flags, cut) in flags.iter().zip(&cut) {
        assert_eq!(flags.contains(Flags::SATURATED), *cut);
        assert!(!flags.contains(Flags::SATURATED | Flags::MOTION));
    }
    // Stated, it flags the same pixels.
    let stated = DemodulationOptions { saturation: Some(4095.0), ..demodulation() };
    let (summary, same) = check(&raw, &stated, &ConsistencyOptions::default());
    assert_eq!((summary.saturation, same), (SaturationVerdict::Stated, flags));
    // Without the search the pixels that are cut off break the rules.
    let options = ConsistencyOptions { plateau: None, ..ConsistencyOptions::default() };
    assert!(inconsistent(&check(&raw, &demodulation(), &options).0) > summary.saturated / 2);
}

#[test]
fn what_is_not_cut_off_has_no_plateau() {
    let (raw, _) = bright_spot(65_535.0);
    let (summary, flags) = check(&raw, &demodulation(), &ConsistencyOptions::default());
    assert_eq!((summary.saturation, summary.saturated), (SaturationVerdict::NotFound, 0));
    assert!(flags.iter().all(|flags| !flags.contains(Flags::SATURATED)));
    // A flat wall without noise: thousands of samples share the highest value, and keep the rules.
    let pixel = |pixel: usize| {
        if pixel < 1000 { [900, 500, 100, 500] } else { [500 + pixel as u16 % 16, 500, 100, 100 + pixel as u16 % 16] }
    };
    let values = (0..4).flat_map(|step| (0..1100).map(move |index| pixel(index)[step])).collect();
    let (summary, _) = check(&frame(1100, 4, Samples::U16(values)), &demodulation(), &ConsistencyOptions::default());
    assert_eq!((summary.saturation, inconsistent(&summary)), (SaturationVerdict::NotFound, 0));
}

#[test]
fn differences_of_taps_are_cut_off_at_both_ends() {
    let truth = |pixel: usize, _: usize| Truth { phase: 0.01 * pixel as f64, amplitude: pixel as f64, offset: 0.0 };
    let values = noisy(3000, 4, 2, truth);
    let samples = values.iter().map(|value| value.round().clamp(-2048.0, 2047.0) as i16).collect();
    let (summary, flags) =
        check(&frame(3000, 4, Samples::I16(samples)), &demodulation(), &ConsistencyOptions::default());
    assert_eq!(summary.saturation, SaturationVerdict::Plateau { highest: Some(2047.0), lowest: Some(-2048.0) });
    let expected =
        (0..3000).filter(|pixel| (0..4).any(|step| !(-2047.5..2046.5).contains(&values[step * 3000 + pixel])));
    assert_eq!(summary.saturated, expected.count());
    assert!(flags[2999].contains(Flags::SATURATED));
}

#[test]
fn flags_are_added_and_saturated_pixels_are_not_judged() {
    let raw = frame(3, 4, Samples::U16(vec![900, 900, 500, 500, 500, 500, 500, 500, 500, 500, 500, 500]));
    let mut flags = Raster::from_vec(3, 1, vec![Flags::SATURATED, Flags::MULTIPATH, Flags::MIXED_PIXEL]).unwrap();
    let summary = check_samples(&raw, &demodulation(), &ConsistencyOptions::default(), &mut flags).unwrap();
    assert_eq!(flags.as_slice(), [Flags::SATURATED, Flags::MULTIPATH | Flags::MOTION, Flags::MIXED_PIXEL]);
    let rules = RulesVerdict::Checked { degrees_of_freedom: 1, pixels: 2, inconsistent: 1 };
    assert_eq!(summary, ConsistencySummary { rules, saturation: SaturationVerdict::NotFound, saturated: 1 });
}

#[test]
fn samples_that_are_not_finite_are_not_judged() {
    let raw =
        frame(3, 4, Samples::F32(vec![f32::NAN, 9e3, 5.0, 5.0, f32::INFINITY, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0, 5.0]));
    let (summary, flags) = check(&raw, &demodulation(), &ConsistencyOptions::default());
    assert!(flags.iter().all(Flags::is_empty));
    assert_eq!(summary.rules, RulesVerdict::Checked { degrees_of_freedom: 1, pixels: 1, inconsistent: 0 });
}

#[test]
fn two_frequencies_share_their_flags() {
    let samples = vec![500, 500, 500, 500, 500, 500, 500, 500, 500, 900, 500, 500, 500, 500, 500, 500];
    let raw = RawFrame::new(2, 1, 4, modulations(2), Samples::U16(samples)).unwrap();
    let (summary, flags) = check(&raw, &demodulation(), &ConsistencyOptions::default());
    assert_eq!(flags, [Flags::empty(), Flags::MOTION]);
    assert_eq!(inconsistent(&summary), 1);
}

#[test]
fn what_cannot_be_checked_is_an_error() {
    let raw = frame(1, 4, Samples::I16(vec![1, 2, 3, 4]));
    let mut flags = Raster::filled(1, 1, Flags::empty());
    let mut name = |demodulation: &DemodulationOptions, options: &ConsistencyOptions| match check_samples(
        &raw,
        demodulation,
        options,
        &mut flags,
    )
    .unwrap_err()
    {
        Error::OutOfDomain { name, .. } => name,
        other => panic!("{other}"),
    };
    assert_eq!(name(&DemodulationOptions::default(), &ConsistencyOptions::default()), "noise");
    // Shot noise says nothing about differences of taps.
    let shot = NoiseModel { dark_sigma: 0.0, ..NOISE };
    let shot = DemodulationOptions { noise: shot, ..DemodulationOptions::default() };
    assert_eq!(name(&shot, &ConsistencyOptions::default()), "noise");
    let default = ConsistencyOptions::default();
    for (options, expected) in [
        (ConsistencyOptions { false_alarm_probability: 0.0, ..default.clone() }, "false_alarm_probability"),
        (ConsistencyOptions { tolerance: f64::NAN, ..default.clone() }, "tolerance"),
        (ConsistencyOptions { harmonics: vec![1], ..default.clone() }, "harmonics"),
    ] {
        assert_eq!(name(&demodulation(), &options), expected);
    }
    assert!(SampleCheck::new(2, &demodulation(), &default).is_err());
    let check = SampleCheck::new(5, &demodulation(), &default).unwrap();
    assert!(matches!(check.check(&raw, &mut flags), Err(Error::OutOfDomain { name: "phase_steps", .. })));
    let mut wide = Raster::filled(2, 1, Flags::empty());
    let check = SampleCheck::new(4, &demodulation(), &default).unwrap();
    assert!(matches!(check.check(&raw, &mut wide), Err(Error::SizeMismatch { .. })));
    let empty = RawFrame::new(0, 3, 4, modulations(1), Samples::U16(vec![])).unwrap();
    let summary = check.check(&empty, &mut Raster::filled(0, 3, Flags::empty())).unwrap();
    assert_eq!(summary.rules, RulesVerdict::Checked { degrees_of_freedom: 1, pixels: 0, inconsistent: 0 });
}

#[test]
fn any_number_of_threads_finds_the_same() {
    let pixels = 100_003;
    let values = noisy(pixels, 4, 1, |pixel, _| Truth { phase: pixel as f64, amplitude: 600.0, offset: 700.0 });
    let raw = frame(pixels, 4, Samples::U16(values.iter().map(|value| value.clamp(0.0, 850.0) as u16).collect()));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| check(&raw, &demodulation(), &ConsistencyOptions::default()))
    };
    let one = run(1);
    assert_eq!(one.0.saturation, SaturationVerdict::Plateau { highest: Some(850.0), lowest: None });
    assert_eq!(one, run(2));
    assert_eq!(one, run(3));
}
