//! The loops for wide registers: accuracy, and the same bits by any way and on any number of threads.

use std::f64::consts::TAU;

use crate::common::{angle_between, modulations};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use range_image::{
    ComplexFrame, DemodulationOptions, Demodulator, Error, NoiseModel, Raster, RawFrame, Samples, demodulate,
};

fn options() -> DemodulationOptions {
    DemodulationOptions {
        phase_offset_rad: 0.7,
        raw_scale: 0.3,
        saturation: Some(3900.0),
        noise: NoiseModel { shot_variance_per_unit: 0.4, dark_sigma: 2.0 },
        low_amplitude: Some(100.0),
        ..DemodulationOptions::default()
    }
}

/// Samples without a pattern, of the three types.
fn frames(width: usize, height: usize, steps: usize, frequencies: usize) -> [RawFrame; 3] {
    let count = width * height * steps * frequencies;
    let values: Vec<u16> = (0..count).map(|i| (i.wrapping_mul(2_654_435_761) >> 7) as u16 % 4001).collect();
    let kinds = [
        Samples::F32(values.iter().map(|&v| f32::from(v) * 1.37 - 600.0).collect()),
        Samples::I16(values.iter().map(|&v| v as i16 - 2000).collect()),
        Samples::U16(values),
    ];
    kinds.map(|samples| RawFrame::new(width, height, steps, modulations(frequencies), samples).unwrap())
}

fn bits(planes: &[&Raster<f32>]) -> Vec<u32> {
    planes.iter().flat_map(|plane| plane.as_slice().iter().map(|value| value.to_bits())).collect()
}

fn bits_of(frame: &ComplexFrame) -> Vec<u32> {
    let channels = frame.channels.iter().flat_map(|channel| {
        bits(&[&channel.real, &channel.imaginary, &channel.sigma, channel.offset.as_ref().unwrap(), &channel.phase()])
    });
    channels.chain(frame.flags.as_slice().iter().map(|flags| u32::from(flags.bits()))).collect()
}

#[test]
fn phase_and_amplitude_are_good_to_single_precision() {
    let directions = 100_001;
    let raw = frames(directions, 1, 4, 1)[0].clone();
    let mut channel = demodulate(&raw, &DemodulationOptions::default()).unwrap().channels.remove(0);
    for (index, (re, im)) in channel.real.as_mut_slice().iter_mut().zip(channel.imaginary.as_mut_slice()).enumerate() {
        let (sin, cos) = (TAU * index as f64 / directions as f64).sin_cos();
        let scale = 10_f64.powi(index as i32 % 60 - 30);
        (*re, *im) = ((scale * cos) as f32, (scale * sin) as f32);
    }
    let (mut phase, mut amplitude) = (channel.sigma.clone(), channel.sigma.clone());
    channel.phase_and_amplitude_into(&mut phase, &mut amplitude).unwrap();
    for index in 0..directions {
        let [x, y] = [&channel.real, &channel.imaginary].map(|plane| f64::from(plane.as_slice()[index]));
        let error = angle_between(f64::from(phase.as_slice()[index]), y.atan2(x));
        // Fit 4e-8, f32's own 2 pi 1.7e-7, polynomial 1e-7, and half a unit in the last place at 2 pi, 2.4e-7.
        assert!(error.abs() < 6e-7, "direction {index}: error {error:e} rad");
        let relative = f64::from(amplitude.as_slice()[index]) / x.hypot(y) - 1.0;
        // Four roundings of 6e-8 each at most.
        assert!(relative.abs() < 2.4e-7, "direction {index}: relative error {relative:e}");
    }
    assert_eq!(bits(&[&phase, &amplitude]), bits(&[&channel.phase(), &channel.amplitude()]));
}

#[test]
fn the_straight_way_gives_the_bits_of_the_long_one() {
    let demodulator = Demodulator::new(&options()).unwrap();
    let mut polar = Vec::new();
    for (width, height, steps) in [(67, 3, 3), (64, 2, 4), (201, 1, 5), (33, 5, 8), (7, 9, 19), (1, 1, 4), (0, 4, 4)] {
        for raw in frames(width, height, steps, 2) {
            let frame = demodulate(&raw, &options()).unwrap();
            demodulator.phase_and_amplitude_into(&raw, &mut polar);
            assert_eq!(polar.len(), 2);
            for (polar, channel) in polar.iter().zip(&frame.channels) {
                assert_eq!(polar.modulation, channel.modulation);
                let long = bits(&[&channel.phase(), &channel.amplitude()]);
                assert_eq!(bits(&[&polar.phase, &polar.amplitude]), long, "{width} x {height}, {steps} steps");
            }
        }
    }
}

#[test]
fn the_straight_way_uses_its_planes_again() {
    let demodulator = Demodulator::new(&options()).unwrap();
    let mut polar = Vec::new();
    let [float, _, unsigned] = frames(90, 40, 4, 2);
    demodulator.phase_and_amplitude_into(&float, &mut polar);
    let places = polar.iter().map(|channel| channel.phase.as_slice().as_ptr()).collect::<Vec<_>>();
    demodulator.phase_and_amplitude_into(&unsigned, &mut polar);
    assert_eq!(places, polar.iter().map(|channel| channel.phase.as_slice().as_ptr()).collect::<Vec<_>>());
    demodulator.phase_and_amplitude_into(&frames(5, 3, 4, 1)[1], &mut polar);
    assert_eq!((polar.len(), polar[0].phase.width(), polar[0].amplitude.height()), (1, 5, 3));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    // Several tasks, the last of them not a multiple of the lanes.
    for raw in frames(403, 301, 4, 2) {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| bits_of(&demodulate(&raw, &options()).unwrap()))
        };
        let one = run(1);
        assert_eq!(one, run(2));
        assert_eq!(one, run(3));
    }
}

#[test]
fn samples_that_are_not_finite_have_no_phase() {
    let mut values = vec![10.0_f32; 4 * 200];
    (values[50], values[200 + 60], values[400 + 199]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
    let raw = RawFrame::new(200, 1, 4, modulations(1), Samples::F32(values)).unwrap();
    let mut polar = Vec::new();
    Demodulator::new(&options()).unwrap().phase_and_amplitude_into(&raw, &mut polar);
    for pixel in 0..200 {
        let missing = [50, 60, 199].contains(&pixel);
        assert_eq!(polar[0].phase[(pixel, 0)].is_nan(), missing, "pixel {pixel}");
        assert_eq!(polar[0].amplitude[(pixel, 0)].is_nan(), missing, "pixel {pixel}");
    }
}

#[test]
fn planes_of_another_size_are_refused() {
    let channel = demodulate(&frames(4, 3, 4, 1)[0], &options()).unwrap().channels.remove(0);
    let (mut fits, mut other) = (channel.sigma.clone(), Raster::filled(3, 3, 0.0));
    for result in [
        channel.phase_and_amplitude_into(&mut other.clone(), &mut fits),
        channel.phase_and_amplitude_into(&mut fits, &mut other),
        channel.sigma_range_into(&mut other),
    ] {
        assert!(matches!(result, Err(Error::SizeMismatch { .. })));
    }
    channel.sigma_range_into(&mut fits).unwrap();
    assert_eq!(bits(&[&fits]), bits(&[&channel.sigma_range()]));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, rng_seed: RngSeed::Fixed(3), ..ProptestConfig::with_cases(48) })]

    #[test]
    fn a_pixel_does_not_depend_on_its_place(
        samples in prop::collection::vec(-4000.0_f32..4000.0, 3..9), copies in 1_usize..200
    ) {
        let values = samples.iter().flat_map(|&value| std::iter::repeat_n(value, copies)).collect();
        let raw = RawFrame::new(copies, 1, samples.len(), modulations(1), Samples::F32(values)).unwrap();
        let frame = demodulate(&raw, &options()).unwrap();
        let alone = RawFrame::new(1, 1, samples.len(), modulations(1), Samples::F32(samples)).unwrap();
        let alone = demodulate(&alone, &options()).unwrap();
        for (plane, single) in [
            (frame.channels[0].phase(), alone.channels[0].phase()),
            (frame.channels[0].sigma.clone(), alone.channels[0].sigma.clone()),
        ] {
            prop_assert!(plane.as_slice().iter().all(|value| value.to_bits() == single[(0, 0)].to_bits()));
        }
        prop_assert!(frame.flags.as_slice().iter().all(|&flags| flags == alone.flags[(0, 0)]));
    }
}
