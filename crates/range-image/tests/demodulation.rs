//! Demodulation against known phases.

use std::f64::consts::TAU;

use crate::common::{Truth, angle_between, frame_f32, modulations, samples};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use range_image::{
    ComplexFrame, DemodulationOptions, Demodulator, Error, Flags, Modulation, PhaseSense, Raster, RawFrame, RawView,
    SampleSlice, Samples, demodulate,
};

fn row(pixels: usize, shift: f64) -> Vec<Truth> {
    let pixel = |i: usize| Truth {
        phase: (TAU * i as f64 / pixels as f64 + shift).rem_euclid(TAU),
        amplitude: 50.0 + i as f64,
        offset: 400.0,
    };
    (0..pixels).map(pixel).collect()
}

#[test]
fn borrowed_samples_have_the_bits_of_owned_ones() {
    let owned = frame_f32(&[row(97, 0.0), row(97, 1.0)], 5);
    let Samples::F32(values) = owned.samples() else { panic!("floating point was asked for") };
    let demodulator = Demodulator::new(&DemodulationOptions::default()).unwrap();
    let (mut one, mut other) = (ComplexFrame::empty(), ComplexFrame::empty());
    demodulator.demodulate_into(&owned, &mut one).unwrap();
    let view = RawView::new(owned.width(), owned.height(), 5, owned.modulations(), values.as_slice().into()).unwrap();
    assert_eq!(view, owned.view());
    demodulator.demodulate_view_into(&view, &mut other).unwrap();
    assert_eq!(one.channels[1].real, other.channels[1].real);
    assert_eq!(one.channels[0].imaginary, other.channels[0].imaginary);
    let short = SampleSlice::F32(&values[1..]);
    assert!(matches!(RawView::new(97, 1, 5, owned.modulations(), short), Err(Error::RasterLength { .. })));
    let counts: &[u16] = &[1; 3];
    assert!(SampleSlice::from(counts).len() == 3 && SampleSlice::I16(&[]).is_empty());
}

#[test]
fn truth_comes_back_for_every_number_of_steps() {
    for steps in [3, 4, 5, 8, 12] {
        let truth = vec![row(97, 0.0), row(97, 1.0)];
        let frame = demodulate(&frame_f32(&truth, steps), &DemodulationOptions::default()).unwrap();
        assert_eq!(frame.channels.len(), 2);
        for (channel, truth) in frame.channels.iter().zip(&truth) {
            let (phase, amplitude) = (channel.phase(), channel.amplitude());
            let offset = channel.offset.clone().unwrap();
            for (i, pixel) in truth.iter().enumerate() {
                // Samples near 550 are rounded to f32 (3e-5), summed in f32: 1e-4 of amplitude 50 and more.
                assert!(angle_between(f64::from(phase[(i, 0)]), pixel.phase).abs() < 3e-6, "{steps} steps, pixel {i}");
                assert!((f64::from(amplitude[(i, 0)]) - pixel.amplitude).abs() < 2e-4);
                assert!((f64::from(offset[(i, 0)]) - pixel.offset).abs() < 2e-4);
            }
        }
        assert!(frame.flags.as_slice().iter().all(Flags::is_empty));
    }
}

#[test]
fn frequencies_keep_their_modulation() {
    let frame = demodulate(&frame_f32(&[row(3, 0.0), row(3, 0.5)], 4), &DemodulationOptions::default()).unwrap();
    let found: Vec<_> = frame.channels.iter().map(|channel| channel.modulation).collect();
    assert_eq!(found, modulations(2));
}

#[test]
fn sense_and_offset_are_undone() {
    let offset = 2.78;
    for steps in [3, 4, 5, 8] {
        let truth = row(64, 0.3);
        // The camera's phase c is such that phi = -c + offset.
        let camera: Vec<_> = truth.iter().map(|t| Truth { phase: offset - t.phase, ..*t }).collect();
        let options = DemodulationOptions {
            phase_sense: PhaseSense::Negative,
            phase_offset_rad: offset,
            ..DemodulationOptions::default()
        };
        let phase = demodulate(&frame_f32(&[camera], steps), &options).unwrap().channels[0].phase();
        for (i, pixel) in truth.iter().enumerate() {
            assert!(angle_between(f64::from(phase[(i, 0)]), pixel.phase).abs() < 3e-6, "{steps} steps, pixel {i}");
        }
    }
}

#[test]
fn four_steps_follow_the_arctangent_of_the_conventions() {
    let [s0, s1, s2, s3] = [731.0_f32, 102.0, 655.0, 940.0];
    let raw = RawFrame::new(1, 1, 4, modulations(1), Samples::F32(vec![s0, s1, s2, s3])).unwrap();
    let phase = demodulate(&raw, &DemodulationOptions::default()).unwrap().channels[0].phase()[(0, 0)];
    // One rounding to f32 at about 1.5 rad and the fit of the arctangent: 1.6e-7.
    assert!((phase - (s3 - s1).atan2(s0 - s2)).abs() < 3e-7);
}

#[test]
fn integer_samples_give_the_same_as_floats() {
    let values: Vec<i16> = (0..4 * 3000).map(|i| ((i * 7919) % 4001) as i16 - 2000).collect();
    let raw = |samples| RawFrame::new(60, 50, 4, modulations(1), samples).unwrap();
    let options = DemodulationOptions { raw_scale: 0.25, ..DemodulationOptions::default() };
    let signed = demodulate(&raw(Samples::I16(values.clone())), &options).unwrap();
    let float = demodulate(&raw(Samples::F32(values.iter().map(|&v| f32::from(v)).collect())), &options).unwrap();
    assert_eq!(signed.channels[0].real, float.channels[0].real);
    assert_eq!(signed.channels[0].imaginary, float.channels[0].imaginary);
    let lifted: Vec<u16> = values.iter().map(|&v| (v + 2000) as u16).collect();
    let unsigned = demodulate(&raw(Samples::U16(lifted)), &options).unwrap();
    // Small integers and weights that are powers of two: exact, whatever the offset.
    assert_eq!(unsigned.channels[0].real, float.channels[0].real);
}

#[test]
fn scale_applies_to_amplitude_offset_and_sigma_but_not_to_saturation() {
    let truth = [vec![Truth { phase: 1.0, amplitude: 100.0, offset: 500.0 }]];
    let noise = range_image::NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 3.0 };
    let options =
        DemodulationOptions { raw_scale: 2.0, saturation: Some(601.0), noise, ..DemodulationOptions::default() };
    let frame = demodulate(&frame_f32(&truth, 5), &options).unwrap();
    let channel = &frame.channels[0];
    assert!((channel.amplitude()[(0, 0)] - 200.0).abs() < 1e-3);
    assert!((channel.offset.as_ref().unwrap()[(0, 0)] - 1000.0).abs() < 1e-3);
    let expected = (2.0_f32 / 5.0 * (0.5 * 1000.0 + 9.0)).sqrt();
    assert!((channel.sigma[(0, 0)] - expected).abs() < 1e-4);
    assert!(frame.flags[(0, 0)].is_empty());
}

#[test]
fn saturated_samples_flag_their_pixel_only_and_keep_the_value() {
    let mut values = vec![100_u16; 4 * 5000];
    values[2 * 5000 + 4321] = 4095;
    let raw = RawFrame::new(100, 50, 4, modulations(1), Samples::U16(values)).unwrap();
    let options = DemodulationOptions { saturation: Some(4095.0), ..DemodulationOptions::default() };
    let frame = demodulate(&raw, &options).unwrap();
    let flagged: Vec<_> = (0..5000).filter(|&i| !frame.flags.as_slice()[i].is_empty()).collect();
    assert_eq!(flagged, [4321]);
    assert_eq!(frame.flags.as_slice()[4321], Flags::SATURATED);
    assert!(frame.channels[0].real.as_slice()[4321].is_finite());
}

#[test]
fn signed_samples_saturate_at_both_ends() {
    let raw = RawFrame::new(3, 1, 3, modulations(1), Samples::I16(vec![0, 0, 0, -2048, 0, 2047, 0, 0, 0])).unwrap();
    let options = DemodulationOptions { saturation: Some(2047.0), ..DemodulationOptions::default() };
    let frame = demodulate(&raw, &options).unwrap();
    assert_eq!(frame.flags.as_slice(), [Flags::SATURATED, Flags::empty(), Flags::SATURATED]);
    // The most negative number has no positive twin in i16.
    let raw = RawFrame::new(1, 1, 3, modulations(1), Samples::I16(vec![i16::MIN, 0, 0])).unwrap();
    assert_eq!(demodulate(&raw, &options).unwrap().flags[(0, 0)], Flags::SATURATED);
}

#[test]
fn samples_that_are_not_finite_stay_where_they_are() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        let mut values = vec![10.0_f32; 2 * 4 * 2000];
        // Two samples, so that the sum of f32::MAX overflows.
        values[700] = bad;
        values[2000 + 700] = bad;
        values[2 * 2000 + 700] = bad;
        let raw = RawFrame::new(50, 40, 4, modulations(2), Samples::F32(values)).unwrap();
        let options = DemodulationOptions { raw_scale: 4.0, ..DemodulationOptions::default() };
        let frame = demodulate(&raw, &options).unwrap();
        for pixel in 0..2000 {
            let nan = frame.channels[0].real.as_slice()[pixel].is_nan();
            assert_eq!(nan, pixel == 700, "{bad}, pixel {pixel}");
            assert_eq!(frame.flags.as_slice()[pixel].contains(Flags::NO_DATA), pixel == 700);
        }
        let channel = &frame.channels[0];
        assert!(channel.imaginary.as_slice()[700].is_nan() && channel.sigma.as_slice()[700].is_nan());
        assert!(channel.offset.as_ref().unwrap().as_slice()[700].is_nan());
        assert!(frame.channels[1].real.as_slice()[700].is_finite());
    }
}

#[test]
fn low_amplitude_is_flagged_at_any_frequency() {
    let pixel = |amplitude| Truth { phase: 2.0, amplitude, offset: 0.0 };
    let truth = [vec![pixel(5.0), pixel(50.0), pixel(50.0)], vec![pixel(50.0), pixel(50.0), pixel(9.0)]];
    let options = DemodulationOptions { low_amplitude: Some(10.0), ..DemodulationOptions::default() };
    let frame = demodulate(&frame_f32(&truth, 4), &options).unwrap();
    assert_eq!(frame.flags.as_slice(), [Flags::LOW_AMPLITUDE, Flags::empty(), Flags::LOW_AMPLITUDE]);
}

#[test]
fn a_demodulator_reuses_its_frame() {
    // With noise: sigma is not NaN then, and frames can be compared.
    let noise = range_image::NoiseModel { shot_variance_per_unit: 1.0, dark_sigma: 1.0 };
    let options = DemodulationOptions { noise, ..DemodulationOptions::default() };
    let demodulator = Demodulator::new(&options).unwrap();
    let mut out = ComplexFrame::empty();
    let first = frame_f32(&[row(90, 0.0), row(90, 0.1)], 4);
    demodulator.demodulate_into(&first, &mut out).unwrap();
    let place = out.channels[1].real.as_slice().as_ptr();
    let second = frame_f32(&[row(90, 0.7), row(90, 0.2)], 4);
    demodulator.demodulate_into(&second, &mut out).unwrap();
    assert_eq!(place, out.channels[1].real.as_slice().as_ptr());
    assert_eq!(out, demodulate(&second, &options).unwrap());
    let smaller = frame_f32(&[row(7, 0.7)], 3);
    demodulator.demodulate_into(&smaller, &mut out).unwrap();
    assert_eq!((out.width(), out.height(), out.channels.len()), (7, 1, 1));
    let whole = out.clone();
    out.channels[0].offset = None;
    demodulator.demodulate_into(&smaller, &mut out).unwrap();
    assert_eq!(out, whole);
}

#[test]
fn without_an_offset_all_else_is_the_same() {
    let modulations = vec![Modulation::new(20e6).unwrap(), Modulation::new(30e6).unwrap()];
    let samples =
        (0..4 * 2 * 70).map(|sample| if sample == 75 { f32::NAN } else { (sample * 37 % 101) as f32 }).collect();
    let raw = RawFrame::new(70, 1, 4, modulations, Samples::F32(samples)).unwrap();
    let demodulator = Demodulator::new(&DemodulationOptions::default()).unwrap();
    let (mut with, mut without) = (ComplexFrame::empty(), ComplexFrame::empty());
    demodulator.demodulate_into(&raw, &mut with).unwrap();
    demodulator.without_offset().demodulate_into(&raw, &mut without).unwrap();
    assert!(with.channels.iter().all(|channel| channel.offset.is_some()));
    assert!(without.channels.iter().all(|channel| channel.offset.is_none()));
    let bits = |plane: &Raster<f32>| plane.as_slice().iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    for (a, b) in with.channels.iter().zip(&without.channels) {
        assert_eq!([&a.real, &a.imaginary, &a.sigma].map(bits), [&b.real, &b.imaginary, &b.sigma].map(bits));
    }
    assert_eq!(with.flags, without.flags);
}

#[test]
fn an_image_without_pixels_gives_one() {
    for (width, height) in [(0, 0), (0, 5), (5, 0)] {
        let raw = RawFrame::new(width, height, 4, modulations(1), Samples::U16(vec![])).unwrap();
        let frame = demodulate(&raw, &DemodulationOptions::default()).unwrap();
        assert_eq!((frame.width(), frame.height(), frame.channels.len()), (width, height, 1));
    }
}

#[test]
fn options_out_of_their_domain_are_named() {
    let with = |change: fn(&mut DemodulationOptions)| {
        let mut options = DemodulationOptions::default();
        change(&mut options);
        Demodulator::new(&options).unwrap_err()
    };
    let named = |error: Error| match error {
        Error::OutOfDomain { name, .. } => name,
        other => panic!("{other}"),
    };
    assert_eq!(named(with(|o| o.raw_scale = 0.0)), "raw_scale");
    assert_eq!(named(with(|o| o.raw_scale = 1e300)), "raw_scale");
    assert_eq!(named(with(|o| o.saturation = Some(f64::NAN))), "saturation");
    assert_eq!(named(with(|o| o.low_amplitude = Some(-1.0))), "low_amplitude");
    assert_eq!(named(with(|o| o.phase_offset_rad = f64::INFINITY)), "phase_offset_rad");
    assert_eq!(named(with(|o| o.noise.dark_sigma = -1.0)), "dark_sigma");
    assert_eq!(named(with(|o| o.noise.shot_variance_per_unit = f64::NAN)), "shot_variance_per_unit");
    assert!(RawFrame::new(2, 2, 2, modulations(1), Samples::U16(vec![0; 8])).is_err());
    assert!(RawFrame::new(2, usize::MAX, 4, modulations(1), Samples::U16(vec![0; 8])).is_err());
}

/// Adds a harmonic of the modulation to the samples and returns the largest error of the phase.
fn error_from_harmonic(harmonic: usize, steps: usize) -> f64 {
    let truth = row(48, 0.0);
    let mut values = samples(std::slice::from_ref(&truth), steps);
    for step in 0..steps {
        for (i, pixel) in truth.iter().enumerate() {
            let angle = pixel.phase + TAU * step as f64 / steps as f64;
            values[step * 48 + i] += 0.1 * pixel.amplitude * (harmonic as f64 * angle).cos();
        }
    }
    let values = values.iter().map(|&v| v as f32).collect();
    let raw = RawFrame::new(48, 1, steps, modulations(1), Samples::F32(values)).unwrap();
    let phase = demodulate(&raw, &DemodulationOptions::default()).unwrap().channels[0].phase();
    let errors = truth.iter().enumerate().map(|(i, t)| angle_between(f64::from(phase[(i, 0)]), t.phase).abs());
    errors.fold(0.0, f64::max)
}

#[test]
fn only_harmonics_next_to_a_multiple_of_the_steps_disturb_the_phase() {
    for steps in 3..=9 {
        for harmonic in 2..=20 {
            let aliased = harmonic % steps == 1 || harmonic % steps == steps - 1;
            let error = error_from_harmonic(harmonic, steps);
            // A tenth of the amplitude turns the phase by up to asin(0.1) = 0.1 rad; rounding by 3e-6.
            assert_eq!(error > 0.09, aliased, "harmonic {harmonic} with {steps} steps: {error} rad");
            assert!(aliased || error < 4e-6, "harmonic {harmonic} with {steps} steps: {error} rad");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::with_cases(64) })]

    #[test]
    fn turning_the_scene_turns_the_phase(
        steps in 3_usize..12, phase in 0.0..TAU, turn in -20.0..20.0_f64, amplitude in 1.0..1000.0_f64, offset in 0.0..2000.0_f64
    ) {
        let frame = frame_f32(&[vec![Truth { phase, amplitude, offset }]], steps);
        let options = DemodulationOptions { phase_offset_rad: turn, ..DemodulationOptions::default() };
        let plain = demodulate(&frame, &DemodulationOptions::default()).unwrap().channels[0].phase()[(0, 0)];
        let turned = demodulate(&frame, &options).unwrap().channels[0].phase()[(0, 0)];
        prop_assert!((0.0..TAU as f32).contains(&turned));
        // Samples up to 3000 carry 1.2e-4 of rounding, each sum a few of them.
        let tolerance = 1e-6 + 1e-3 / amplitude;
        prop_assert!(angle_between(f64::from(turned), f64::from(plain) + turn).abs() < tolerance);
    }
}
