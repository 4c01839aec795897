//! Shot and dark noise from repeated raw frames, against the truth.

use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{ComplexFrame, DemodulationOptions, Modulation, NoiseModel, RawFrame, Samples, demodulate};
use sensor_noise::Error;
use sensor_noise::{
    NoiseFitOptions, RepeatedSamples, SampleNoiseEstimate, SampleUnits, SigmaVerdict, VarianceEstimator,
    check_complex_sigma, estimate_sample_noise,
};

const SIZE: [usize; 2] = [40, 30];
const TRUTH: NoiseModel = NoiseModel { shot_variance_per_unit: 0.8, dark_sigma: 6.0 };

/// Where and how a scene departs from one at rest.
#[derive(Default, Clone, Copy)]
struct Scene {
    /// Mean sample of the brightest pixel less that of the darkest.
    contrast: f64,
    modulated: f64,
    /// Share of its light that every sample gains from frame to frame.
    drift: f64,
    /// Share of the light that frame 3 has more.
    jump: f64,
    /// Columns, spread over the image, whose light is another in each frame.
    moving_columns: usize,
}

const STILL: Scene = Scene { contrast: 2000.0, modulated: 0.4, drift: 0.0, jump: 0.0, moving_columns: 0 };

/// Means of all samples of one frame, `[4, H, W]`.
fn light(scene: &Scene, frame: usize) -> Vec<f64> {
    let [width, height] = SIZE;
    let mut out = Vec::with_capacity(4 * width * height);
    for step in 0..4 {
        for pixel in 0..width * height {
            let (col, row) = (pixel % width, pixel / width);
            let share = (col * height + row) as f64 / (width * height) as f64;
            let offset = 100.0 + scene.contrast * share;
            let phase = 0.1 * row as f64 + std::f64::consts::FRAC_PI_2 * f64::from(step);
            let mut mean = offset * (1.0 + scene.modulated * phase.cos());
            mean *= 1.0 + scene.drift * frame as f64;
            mean *= if frame == 3 { 1.0 + scene.jump } else { 1.0 };
            mean *= if 7 * col % width < scene.moving_columns { 1.0 + 0.3 * (frame % 2) as f64 } else { 1.0 };
            out.push(mean);
        }
    }
    out
}

fn frames(scene: &Scene, count: usize, seed: u64, store: impl Fn(Vec<f64>) -> Samples) -> Vec<RawFrame> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut noisy = |mean: &f64| {
        let unit: f64 = StandardNormal.sample(&mut random);
        mean + unit * (TRUTH.shot_variance_per_unit * mean + TRUTH.dark_sigma.powi(2)).sqrt()
    };
    let modulations = vec![Modulation::new(30e6).unwrap()];
    let mut one = |frame| {
        let samples = light(scene, frame).iter().map(&mut noisy).collect();
        RawFrame::new(SIZE[0], SIZE[1], 4, modulations.clone(), store(samples)).unwrap()
    };
    (0..count).map(&mut one).collect()
}

fn exact(values: Vec<f64>) -> Samples {
    Samples::F32(values.into_iter().map(|value| value as f32).collect())
}

fn estimate(frames: &[RawFrame], units: &SampleUnits) -> Result<SampleNoiseEstimate, Error> {
    let station = RepeatedSamples { station: "A".into(), frames };
    estimate_sample_noise(&[station], units, &NoiseFitOptions::default())
}

fn estimate_exact(scene: &Scene, count: usize, seed: u64) -> Result<SampleNoiseEstimate, Error> {
    estimate(&frames(scene, count, seed, exact), &SampleUnits::default())
}

#[test]
fn the_covariance_is_that_of_repeated_estimates() {
    let truth = nalgebra::Vector2::new(TRUTH.shot_variance_per_unit, TRUTH.dark_sigma.powi(2));
    let runs = 40;
    let squares = (0..runs).map(|seed: u32| {
        let fit = estimate_exact(&STILL, 6, u64::from(seed)).unwrap().fit;
        let error = nalgebra::Vector2::new(fit.slope, fit.level) - truth;
        let [[a, b], [c, d]] = fit.covariance;
        error.dot(&(nalgebra::Matrix2::new(a, b, c, d).try_inverse().unwrap() * error))
    });
    let squares: Vec<f64> = squares.collect();
    let mean = squares.iter().sum::<f64>() / f64::from(runs);
    println!("mean of e' C^-1 e over {runs} runs: {mean:.2}, expected 2");
    // χ² of 2 degrees of freedom: the mean of 40 has a deviation of 0.32. Deviations are scaled by sigma0 where that is
    // above 1, which takes some 0.1 off. Four deviations.
    assert!((0.7..3.3).contains(&mean), "{mean}");
    assert!(squares.iter().all(|square| *square < 20.0), "{squares:?}");
}

#[test]
fn rounding_is_told_from_dark_noise() {
    let units = SampleUnits { raw_scale: 8.0, saturation: None };
    let store = |values: Vec<f64>| Samples::U16(values.iter().map(|value| (value / 8.0).round() as u16).collect());
    let estimate = estimate(&frames(&STILL, 8, 3, store), &units).unwrap();
    // Samples of eight units: 8 / √12.
    assert!((estimate.quantisation_sigma - 2.309_401).abs() < 1e-6);
    let expected = (TRUTH.dark_sigma.powi(2) + 64.0 / 12.0).sqrt();
    let sigma = estimate.parameters()[1].sigma;
    assert!((estimate.noise.dark_sigma - expected).abs() < 4.0 * sigma, "{} ± {sigma}", estimate.noise.dark_sigma);
    let parameters = estimate.parameters();
    assert_eq!(parameters[2].name, "quantisation_sigma");
    assert!(parameters[2].sigma.abs() < f64::MIN_POSITIVE, "it is held");
}

#[test]
fn differences_of_two_taps_have_dark_noise_alone() {
    let mut random = Pcg64::seed_from_u64(9);
    let mut one = || {
        let mut noisy = || -> i16 {
            let unit: f64 = StandardNormal.sample(&mut random);
            (300.0 + 20.0 * unit).round() as i16
        };
        let samples = (0..4 * SIZE[0] * SIZE[1]).map(|_| noisy()).collect();
        RawFrame::new(SIZE[0], SIZE[1], 4, vec![Modulation::new(30e6).unwrap()], Samples::I16(samples)).unwrap()
    };
    let frames: Vec<RawFrame> = (0..5).map(|_| one()).collect();
    let estimate = estimate(&frames, &SampleUnits::default()).unwrap();
    assert!(estimate.without_light && estimate.noise.shot_variance_per_unit.abs() < f64::MIN_POSITIVE);
    let sigma = estimate.parameters()[1].sigma;
    assert!((estimate.noise.dark_sigma - (400.0_f64 + 1.0 / 12.0).sqrt()).abs() < 4.0 * sigma);
}

#[test]
fn a_slow_drift_is_seen_and_does_not_enter() {
    // 0.1 % a frame over 12 frames: a tenth of the noise of a bright sample.
    let drifting = Scene { drift: 1e-3, ..STILL };
    let estimate = estimate_exact(&drifting, 12, 5).unwrap();
    assert_eq!(estimate.fit.estimator, VarianceEstimator::SuccessiveDifferences);
    assert!(estimate.fit.steadiness[0].drifts, "{:?}", estimate.fit.steadiness);
    let parameters = estimate.parameters();
    // Successive differences still hold T 6 / n (n + 1) of the drift, below a hundredth.
    let shot = &parameters[0];
    assert!((shot.value - 0.8).abs() < 4.0 * shot.sigma + 0.01, "{shot:?}");
    let still = estimate_exact(&STILL, 12, 5).unwrap();
    assert_eq!(still.fit.estimator, VarianceEstimator::AboutMean);
    assert!(still.fit.steadiness[0].ratio > 0.99);
}

#[test]
fn what_is_not_at_rest_is_refused() {
    let fast = Scene { drift: 0.02, ..STILL };
    let answer = estimate_exact(&fast, 5, 1);
    assert!(matches!(answer, Err(Error::FramesDrift { ref station, .. }) if station == "A"), "{answer:?}");
    let flash = Scene { jump: 0.03, ..STILL };
    let answer = estimate_exact(&flash, 8, 2);
    assert!(matches!(answer, Err(Error::FrameStandsOut { frame: 3, .. })), "{answer:?}");
    let moving = Scene { moving_columns: 12, ..STILL };
    let answer = estimate_exact(&moving, 8, 2);
    assert!(matches!(answer, Err(Error::SceneMoved { .. })), "{answer:?}");
    // A tenth of the scene may move: it is left out.
    let partly = Scene { moving_columns: 4, ..STILL };
    let estimate = estimate_exact(&partly, 8, 2).unwrap();
    let [shot, ..] = &estimate.parameters()[..] else { panic!("no parameters") };
    assert!((shot.value - 0.8).abs() < 4.0 * shot.sigma, "{shot:?}");
    assert!(estimate.fit.moved > 4 * 3 * SIZE[1], "{} moved", estimate.fit.moved);
}

#[test]
fn bad_input_is_refused_by_name() {
    let answer = estimate_exact(&STILL, 1, 1);
    assert!(matches!(answer, Err(Error::TooFewFrames { frames: 1, needed: 2, .. })), "{answer:?}");
    let uniform = Scene { contrast: 0.0, modulated: 0.0, ..STILL };
    let answer = estimate_exact(&uniform, 6, 1);
    assert!(matches!(answer, Err(Error::NoisePartsNotApart { .. })), "{answer:?}");
    let mut unlike = frames(&STILL, 3, 1, exact);
    unlike[2] = RawFrame::new(2, 2, 4, vec![Modulation::new(30e6).unwrap()], Samples::F32(vec![0.0; 16])).unwrap();
    let answer = estimate(&unlike, &SampleUnits::default());
    assert!(matches!(answer, Err(Error::FramesDiffer { frame: 2, .. })), "{answer:?}");
    let answer = estimate(&frames(&STILL, 3, 1, exact), &SampleUnits { raw_scale: 1.0, saturation: Some(50.0) });
    assert!(matches!(answer, Err(Error::TooFewRepeats { .. })), "{answer:?}");
    let answer = estimate(&frames(&STILL, 3, 1, exact), &SampleUnits { raw_scale: -1.0, saturation: None });
    assert!(matches!(answer, Err(Error::OutOfDomain { name: "raw_scale", .. })), "{answer:?}");
}

#[test]
fn sigma_is_judged_by_its_own_statistics() {
    let raw = frames(&STILL, 8, 4, exact);
    let with = |noise: NoiseModel| -> Vec<ComplexFrame> {
        let options = DemodulationOptions { noise, ..DemodulationOptions::default() };
        raw.iter().map(|frame| demodulate(frame, &options).unwrap()).collect()
    };
    let check = |noise| check_complex_sigma(&[&with(noise)[..]], VarianceEstimator::AboutMean).unwrap();
    let estimated = check(estimate(&raw, &SampleUnits::default()).unwrap().noise);
    // One part of z gets less than the mean of the samples where it looks at the darker pair of them, the other more: the
    // two together are what sigma says.
    assert!(matches!(estimated.verdict, SigmaVerdict::True | SigmaVerdict::Close), "{estimated:?}");
    assert!((estimated.ratio - 1.0).abs() < 0.03, "{}", estimated.ratio);
    let half = check(NoiseModel { shot_variance_per_unit: 0.2, dark_sigma: 3.0 });
    assert_eq!(half.verdict, SigmaVerdict::TooSmall);
    let double = check(NoiseModel { shot_variance_per_unit: 3.2, dark_sigma: 12.0 });
    assert_eq!(double.verdict, SigmaVerdict::TooLarge);
    let dark = check(NoiseModel { shot_variance_per_unit: 0.0, dark_sigma: 30.0 });
    assert_eq!(dark.verdict, SigmaVerdict::Mixed);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    #[test]
    fn another_unit_gives_the_same_noise_in_that_unit(scale in 0.01..100.0_f64, seed in 0_u64..100) {
        let raw = frames(&STILL, 4, seed, exact);
        let one = estimate(&raw, &SampleUnits::default()).unwrap();
        let other = estimate(&raw, &SampleUnits { raw_scale: scale, saturation: None }).unwrap();
        // Variances scale with the square, the shot noise per unit with the unit; rounding of sums of thousands of values.
        prop_assert!((other.noise.dark_sigma / one.noise.dark_sigma / scale - 1.0).abs() < 1e-6);
        prop_assert!((other.noise.shot_variance_per_unit / one.noise.shot_variance_per_unit / scale - 1.0).abs() < 1e-6);
    }
}
