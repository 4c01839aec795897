//! Predicted standard deviations against sampled ones, and averages.

use crate::common::{Truth, angle_between, modulations};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64Mcg;
use range_image::{
    ComplexFrame, DemodulationOptions, Error, Flags, NoiseModel, RangeFrame, Raster, RawFrame, Samples, average,
    average_ranges, demodulate, sigma_from_repeats,
};

const NOISE: NoiseModel = NoiseModel { shot_variance_per_unit: 0.8, dark_sigma: 4.0 };

/// `pixels` noisy copies of one pixel, normally distributed with the variance of the model.
fn noisy_row(truth: Truth, steps: usize, pixels: usize, seed: u64) -> RawFrame {
    let mut generator = Pcg64Mcg::seed_from_u64(seed);
    let mut values = Vec::with_capacity(steps * pixels);
    for step in 0..steps {
        let sample = truth.sample(step, steps);
        let variance = NOISE.shot_variance_per_unit * sample.max(0.0) + NOISE.dark_sigma.powi(2);
        let distribution = Normal::new(sample, variance.sqrt()).unwrap();
        values.extend((0..pixels).map(|_| distribution.sample(&mut generator) as f32));
    }
    RawFrame::new(pixels, 1, steps, modulations(1), Samples::F32(values)).unwrap()
}

fn options() -> DemodulationOptions {
    DemodulationOptions { noise: NOISE, ..DemodulationOptions::default() }
}

fn standard_deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    (values.map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt()
}

fn mean(values: &Raster<f32>) -> f64 {
    values.as_slice().iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

#[test]
fn predicted_sigma_of_phase_and_range_matches_the_sampled_one() {
    for (seed, steps) in [4, 5, 8].into_iter().enumerate() {
        for phase in [0.3, 2.0, 4.4] {
            let truth = Truth { phase, amplitude: 400.0, offset: 900.0 };
            let frame = demodulate(&noisy_row(truth, steps, 20_000, seed as u64), &options()).unwrap();
            let channel = &frame.channels[0];
            let phases = channel.phase();
            let errors = phases.as_slice().iter().map(|&p| angle_between(f64::from(p), phase));
            let sampled = standard_deviation(errors);
            let ratio = sampled / mean(&channel.sigma_phase());
            // 20,000 samples give a standard deviation to 0.5 %; four times that, and 0.3 % from A >> sigma.
            assert!((ratio - 1.0).abs() < 0.023, "{steps} steps, phase {phase}: sampled / predicted {ratio}");
            let metres = sampled * modulations(1)[0].ambiguity_interval_m() / std::f64::consts::TAU;
            assert!((metres / mean(&channel.sigma_range()) - 1.0).abs() < 0.023);
        }
    }
}

#[test]
fn three_steps_scatter_with_three_times_the_phase() {
    // var(phi) = 2 / 3 A^2 (var - shot A cos(3 phi) / 2): sigma is the mean over the two parts of z.
    for phase in [0.0, std::f64::consts::FRAC_PI_6, std::f64::consts::FRAC_PI_3] {
        let truth = Truth { phase, amplitude: 400.0, offset: 900.0 };
        let frame = demodulate(&noisy_row(truth, 3, 40_000, 77), &options()).unwrap();
        let phases = frame.channels[0].phase();
        let sampled = standard_deviation(phases.as_slice().iter().map(|&p| angle_between(f64::from(p), phase)));
        let variance = NOISE.shot_variance_per_unit * truth.offset + NOISE.dark_sigma.powi(2);
        let wave = NOISE.shot_variance_per_unit * truth.amplitude * (3.0 * phase).cos() / 2.0;
        let expected = (2.0 / 3.0 * (variance - wave)).sqrt() / truth.amplitude;
        // 40,000 samples: 0.35 %, four times that and the second order of sigma / A.
        assert!((sampled / expected - 1.0).abs() < 0.02, "phase {phase}: {}", sampled / expected);
        let real = standard_deviation(frame.channels[0].real.as_slice().iter().map(|&v| f64::from(v)));
        let imaginary = standard_deviation(frame.channels[0].imaginary.as_slice().iter().map(|&v| f64::from(v)));
        let both = f64::midpoint(real * real, imaginary * imaginary).sqrt();
        assert!((both / mean(&frame.channels[0].sigma) - 1.0).abs() < 0.02);
    }
}

#[test]
fn averaging_n_frames_divides_sigma_by_the_root_of_n() {
    let truth = Truth { phase: 1.1, amplitude: 60.0, offset: 300.0 };
    let frames: Vec<_> =
        (0..16).map(|seed| demodulate(&noisy_row(truth, 4, 4000, seed), &options()).unwrap()).collect();
    let mean_frame = average(&frames).unwrap();
    let channel = &mean_frame.channels[0];
    let phases = channel.phase();
    let sampled = standard_deviation(phases.as_slice().iter().map(|&p| angle_between(f64::from(p), 1.1)));
    let predicted = mean(&channel.sigma_phase());
    // 4000 pixels: 1.1 %; four times that.
    assert!((sampled / predicted - 1.0).abs() < 0.045, "{}", sampled / predicted);
    assert!((mean(&frames[0].channels[0].sigma) / mean(&channel.sigma) - 4.0).abs() < 0.02);
    // The scatter of the repeats says the same without a noise model.
    let repeats = sigma_from_repeats(&frames, 0).unwrap();
    let rms = (repeats.as_slice().iter().map(|&v| f64::from(v).powi(2)).sum::<f64>() / 4000.0).sqrt();
    assert!((rms / mean(&frames[0].channels[0].sigma) - 1.0).abs() < 0.01, "{rms}");
    let mut unknown = frames.clone();
    for frame in &mut unknown {
        frame.channels[0].sigma.as_mut_slice().fill(f32::NAN);
    }
    let scatter = &average(&unknown).unwrap().channels[0].sigma;
    for (a, b) in scatter.as_slice().iter().zip(repeats.as_slice()) {
        assert!((a * 4.0 / b - 1.0).abs() < 1e-6);
    }
}

fn one_pixel(re: f32, im: f32, sigma: f32, flags: Flags) -> ComplexFrame {
    let raw = RawFrame::new(1, 1, 4, modulations(1), Samples::U16(vec![0; 4])).unwrap();
    let mut frame = demodulate(&raw, &DemodulationOptions::default()).unwrap();
    frame.channels[0].real[(0, 0)] = re;
    frame.channels[0].imaginary[(0, 0)] = im;
    frame.channels[0].sigma[(0, 0)] = sigma;
    frame.flags[(0, 0)] = flags;
    frame
}

#[test]
fn the_mean_is_one_of_complex_numbers() {
    // Phases 0.1 and 2 pi - 0.1: their mean as numbers would be pi.
    let (sin, cos) = 0.1_f32.sin_cos();
    let frames = [one_pixel(cos, sin, 1.0, Flags::empty()), one_pixel(cos, -sin, 1.0, Flags::MOTION)];
    let mean = average(&frames).unwrap();
    assert!(mean.channels[0].phase()[(0, 0)] < 1e-6);
    assert_eq!(mean.flags[(0, 0)], Flags::MOTION);
    assert!((mean.channels[0].sigma[(0, 0)] - 0.5_f32.sqrt()).abs() < 1e-6);
}

#[test]
fn missing_values_are_left_out() {
    let gap = one_pixel(f32::NAN, f32::NAN, f32::NAN, Flags::NO_DATA | Flags::MOTION);
    let value = one_pixel(3.0, 4.0, 2.0, Flags::empty());
    let mean = average(&[gap.clone(), value.clone(), gap.clone()]).unwrap();
    assert_eq!(mean.channels[0].amplitude()[(0, 0)].to_bits(), 5.0_f32.to_bits());
    assert_eq!(mean.channels[0].sigma[(0, 0)].to_bits(), 2.0_f32.to_bits());
    assert_eq!(mean.flags[(0, 0)], Flags::MOTION);
    let nothing = average(&[gap.clone(), gap]).unwrap();
    assert!(nothing.channels[0].real[(0, 0)].is_nan() && nothing.channels[0].sigma[(0, 0)].is_nan());
    assert!(nothing.flags[(0, 0)].contains(Flags::NO_DATA));
    assert_eq!(average(std::slice::from_ref(&value)).unwrap(), value);
}

#[test]
fn frames_that_do_not_belong_together_are_refused() {
    assert_eq!(average(&[]), Err(Error::NoFrames { what: "average" }));
    assert!(matches!(sigma_from_repeats(&[], 0), Err(Error::NoFrames { .. })));
    let small = one_pixel(1.0, 0.0, 1.0, Flags::empty());
    assert!(matches!(sigma_from_repeats(std::slice::from_ref(&small), 0), Err(Error::OutOfDomain { .. })));
    assert!(matches!(sigma_from_repeats(&[small.clone(), small.clone()], 1), Err(Error::OutOfDomain { .. })));
    let wide = demodulate(&noisy_row(Truth { phase: 1.0, amplitude: 1.0, offset: 1.0 }, 4, 2, 0), &options()).unwrap();
    assert!(matches!(average(&[small.clone(), wide]), Err(Error::Inconsistent { index: 1, .. })));
    let mut broken = small.clone();
    broken.channels[0].imaginary = Raster::filled(2, 2, 0.0);
    assert!(matches!(average(&[small.clone(), broken]), Err(Error::SizeMismatch { .. })));
    let mut other = small.clone();
    other.channels.clear();
    assert!(matches!(average(&[small, other]), Err(Error::Inconsistent { index: 1, .. })));
}

#[test]
fn without_a_noise_model_sigma_is_unknown() {
    let raw = noisy_row(Truth { phase: 1.0, amplitude: 50.0, offset: 100.0 }, 4, 10, 1);
    let frame = demodulate(&raw, &DemodulationOptions::default()).unwrap();
    assert!(frame.channels[0].sigma.as_slice().iter().all(|sigma| sigma.is_nan()));
    assert!(NoiseModel::default().sigma_z(100.0, 4).is_nan());
}

#[test]
fn differences_of_taps_get_the_dark_noise_alone() {
    let raw = RawFrame::new(1, 1, 4, modulations(1), Samples::I16(vec![500, 400, 300, 400])).unwrap();
    let sigma = |noise| {
        let options = DemodulationOptions { noise, ..DemodulationOptions::default() };
        demodulate(&raw, &options).unwrap().channels[0].sigma[(0, 0)]
    };
    assert!((sigma(NOISE) - (2.0_f32 / 4.0 * 16.0).sqrt()).abs() < 1e-6);
    assert!(sigma(NoiseModel { dark_sigma: 0.0, ..NOISE }).is_nan());
}

#[test]
fn sigma_can_be_predicted_after_the_fact() {
    let raw = noisy_row(Truth { phase: 1.0, amplitude: 50.0, offset: 100.0 }, 5, 10, 1);
    let expected = demodulate(&raw, &options()).unwrap();
    let mut channel = demodulate(&raw, &DemodulationOptions::default()).unwrap().channels.remove(0);
    channel.predict_sigma(&NOISE, 5).unwrap();
    for (a, b) in channel.sigma.as_slice().iter().zip(expected.channels[0].sigma.as_slice()) {
        assert!((a / b - 1.0).abs() < 1e-6);
    }
    channel.offset = None;
    channel.predict_sigma(&NOISE, 5).unwrap();
    assert!((channel.sigma[(0, 0)] - (2.0_f32 / 5.0 * 16.0).sqrt()).abs() < 1e-6);
}

fn range_frame(range: f32, sigma: f32, amplitude: f32, flags: Flags) -> RangeFrame {
    RangeFrame {
        range: Raster::filled(1, 1, range),
        sigma: Raster::filled(1, 1, sigma),
        amplitude: Raster::filled(1, 1, amplitude),
        flags: Raster::filled(1, 1, flags),
    }
}

#[test]
fn range_frames_are_averaged_over_their_values() {
    let gap = range_frame(f32::NAN, f32::NAN, 7.0, Flags::NO_DATA);
    let frames = [
        range_frame(2.0, f32::NAN, 10.0, Flags::empty()),
        gap.clone(),
        range_frame(2.2, f32::NAN, f32::NAN, Flags::MIXED_PIXEL | Flags::OUTSIDE_SPAN),
        range_frame(2.4, f32::NAN, 20.0, Flags::MIXED_PIXEL),
    ];
    let mean = average_ranges(&frames).unwrap();
    assert!((mean.range[(0, 0)] - 2.2).abs() < 1e-6);
    // Scatter 0.2 of a single value, three of them.
    assert!((mean.sigma[(0, 0)] - 0.2 / 3.0_f32.sqrt()).abs() < 1e-6);
    assert!((mean.amplitude[(0, 0)] - 15.0).abs() < 1e-6);
    assert_eq!(mean.flags[(0, 0)], Flags::MIXED_PIXEL);
    let single = average_ranges(&[gap.clone(), range_frame(2.0, 0.5, 10.0, Flags::empty())]).unwrap();
    assert!((single.sigma[(0, 0)] - 0.5).abs() < 1e-6);
    let nothing = average_ranges(&[gap]).unwrap();
    assert!(nothing.range[(0, 0)].is_nan() && nothing.sigma[(0, 0)].is_nan());
    assert_eq!(nothing.flags[(0, 0)], Flags::NO_DATA);
    assert!(matches!(average_ranges(&[]), Err(Error::NoFrames { .. })));
}

#[test]
fn sigma_of_a_hopeless_phase_is_bounded() {
    let frame = one_pixel(0.0, 0.0, 2.0, Flags::empty());
    let bound = std::f32::consts::PI / 3.0_f32.sqrt();
    assert!((frame.channels[0].sigma_phase()[(0, 0)] - bound).abs() < 1e-6);
    assert!(one_pixel(1.0, 0.0, f32::NAN, Flags::empty()).channels[0].sigma_phase()[(0, 0)].is_nan());
}
