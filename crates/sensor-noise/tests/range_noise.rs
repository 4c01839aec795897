//! Noise of ranges from repeated range frames, against the truth.

use error_models::{AmplitudeScale, RangeNoise};
use nalgebra::{Matrix2, Vector2};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Flags, RangeFrame, Raster};
use sensor_noise::Error;
use sensor_noise::{
    NoiseFitOptions, RangeNoiseEstimate, RepeatedRanges, SigmaVerdict, VarianceEstimator, check_range_sigma,
    estimate_range_noise,
};

const SIZE: [usize; 2] = [60, 50];
const TRUTH: RangeNoise = RangeNoise {
    sigma_times_amplitude_m: 2.0,
    floor_m: 0.004,
    amplitude_scale: AmplitudeScale::AsReceived,
    shared: None,
};

/// Frames of a tilted wall whose light falls off from 2000 to 100 over the columns.
fn frames(truth: &RangeNoise, count: usize, seed: u64) -> Vec<RangeFrame> {
    let mut random = Pcg64::seed_from_u64(seed);
    let [width, height] = SIZE;
    let amplitude = |col: usize| 100.0 * 20.0_f64.powf(1.0 - col as f64 / width as f64);
    let mut one = || RangeFrame {
        range: Raster::from_fn(width, height, |col, row| {
            let unit: f64 = StandardNormal.sample(&mut random);
            (2.0 + 0.01 * row as f64 + unit * truth.sigma_m(amplitude(col), 1.0)) as f32
        }),
        sigma: Raster::filled(width, height, f32::NAN),
        amplitude: Raster::from_fn(width, height, |col, _| amplitude(col) as f32),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    (0..count).map(|_| one()).collect()
}

fn station(frames: &[RangeFrame]) -> RepeatedRanges<&[RangeFrame]> {
    RepeatedRanges { station: "A".into(), frames, interval_m: None }
}

fn estimate(frames: &[RangeFrame]) -> Result<RangeNoiseEstimate, Error> {
    estimate_range_noise(&[station(frames)], false, &NoiseFitOptions::default())
}

#[test]
fn the_covariance_is_that_of_repeated_estimates() {
    let truth = Vector2::new(TRUTH.sigma_times_amplitude_m.powi(2), TRUTH.floor_m.powi(2));
    let runs = 40_u32;
    let square = |seed: u32| {
        let fit = estimate(&frames(&TRUTH, 4, u64::from(seed))).unwrap().fit;
        let [[a, b], [c, d]] = fit.covariance;
        // Variances of metres and of metres times amplitude differ by ten orders: the second in units of the first.
        let unit = a.sqrt() / d.sqrt();
        let covariance = Matrix2::new(a, b * unit, c * unit, d * unit * unit);
        let mut error = Vector2::new(fit.slope, fit.level) - truth;
        error[1] *= unit;
        error.dot(&(covariance.try_inverse().unwrap() * error))
    };
    let squares: Vec<f64> = (0..runs).map(square).collect();
    let mean = squares.iter().sum::<f64>() / f64::from(runs);
    println!("mean of e' C^-1 e over {runs} runs: {mean:.2}, expected 2");
    // χ² of 2 degrees of freedom: the mean of 40 has a deviation of 0.32; scaling by sigma0 > 1 takes some 0.1 off.
    assert!((0.7..3.3).contains(&mean), "{mean}");
}

#[test]
fn predicted_sigma_passes_its_own_check() {
    let mut frames = frames(&TRUTH, 6, 7);
    let estimate = estimate(&frames).unwrap();
    let [scaled, floor] = &estimate.parameters()[..] else { panic!("two parameters") };
    assert!((scaled.value - 2.0).abs() < 4.0 * scaled.sigma, "{scaled:?}");
    assert!((floor.value - 0.004).abs() < 4.0 * floor.sigma, "{floor:?}");
    for frame in &mut frames {
        estimate.noise.predict_sigma(frame).unwrap();
    }
    let check = check_range_sigma(&[station(&frames)], VarianceEstimator::AboutMean).unwrap();
    assert_eq!(check.verdict, SigmaVerdict::True, "{check:?}");
    for frame in &mut frames {
        frame.sigma = Raster::filled(SIZE[0], SIZE[1], 0.008);
    }
    let check = check_range_sigma(&[station(&frames)], VarianceEstimator::AboutMean).unwrap();
    assert_eq!(check.verdict, SigmaVerdict::Mixed, "one sigma for all amplitudes: {check:?}");
}

#[test]
fn no_floor_is_held_at_zero_or_lies_within_its_deviation() {
    let without = RangeNoise { floor_m: 0.0, ..TRUTH };
    for seed in 0..10 {
        let estimate = estimate(&frames(&without, 4, 100 + seed)).unwrap();
        let variance = estimate.fit.covariance[1][1].sqrt();
        assert!(estimate.fit.held[1] || estimate.fit.level < 4.0 * variance, "{:?}", estimate.fit.level);
    }
}

#[test]
fn wrapped_ranges_are_differenced_modulo_their_interval() {
    let mut wrapped = frames(&TRUTH, 5, 3);
    for frame in &mut wrapped {
        frame.range = frame.range.map(|range| (range - 2.25).rem_euclid(5.0));
    }
    let mut one = station(&wrapped);
    one.interval_m = Some(5.0);
    let estimate = estimate_range_noise(&[one], true, &NoiseFitOptions::default()).unwrap();
    let plain = self::estimate(&frames(&TRUTH, 5, 3)).unwrap();
    // Single precision near 5 m is 0.2 µm; noise is 4 mm.
    assert!((estimate.fit.slope / plain.fit.slope - 1.0).abs() < 1e-3);
    assert_eq!(estimate.fit.moved, plain.fit.moved);
}

#[test]
fn without_amplitudes_noise_follows_the_squared_range() {
    let depth = RangeNoise {
        sigma_times_amplitude_m: 0.0015,
        floor_m: 0.001,
        amplitude_scale: AmplitudeScale::InverseSquaredRange,
        shared: None,
    };
    let range = |col: usize| 0.8 + 0.05 * col as f64;
    for seed in 0..5 {
        let mut random = Pcg64::seed_from_u64(300 + seed);
        let mut one = || RangeFrame {
            range: Raster::from_fn(SIZE[0], SIZE[1], |col, _| {
                let unit: f64 = StandardNormal.sample(&mut random);
                (range(col) + unit * depth.sigma_m(f64::NAN, range(col))) as f32
            }),
            sigma: Raster::filled(SIZE[0], SIZE[1], f32::NAN),
            amplitude: Raster::filled(SIZE[0], SIZE[1], f32::NAN),
            flags: Raster::filled(SIZE[0], SIZE[1], Flags::empty()),
        };
        let mut frames: Vec<RangeFrame> = (0..6).map(|_| one()).collect();
        let estimate = estimate(&frames).unwrap();
        assert_eq!(estimate.noise.amplitude_scale, AmplitudeScale::InverseSquaredRange);
        let [slope, floor] = &estimate.parameters()[..] else { panic!("two parts") };
        assert!((slope.value - 0.0015).abs() < 4.0 * slope.sigma && slope.sigma < 1e-4, "{slope:?}");
        assert!((floor.value - 0.001).abs() < 4.0 * floor.sigma, "{floor:?}");
        for frame in &mut frames {
            estimate.noise.predict_sigma(frame).unwrap();
        }
        let check = check_range_sigma(&[station(&frames)], VarianceEstimator::AboutMean).unwrap();
        assert_eq!(check.verdict, SigmaVerdict::True, "{check:?}");
    }
}

/// Noise of unit variance, a share of which is the mean over windows of a width.
fn partly_smooth(share: f64, width: usize, random: &mut Pcg64) -> Raster<f64> {
    let (wide, high) = (SIZE[0] + width, SIZE[1] + width);
    let mut unit = || -> f64 { StandardNormal.sample(random) };
    let white = Raster::from_fn(wide, high, |_, _| unit());
    let own = Raster::from_fn(SIZE[0], SIZE[1], |_, _| unit());
    Raster::from_fn(SIZE[0], SIZE[1], |col, row| {
        let window = (0..width * width).map(|k| white.get(col + k % width, row + k / width).unwrap());
        share.sqrt() * window.sum::<f64>() / width as f64 + (1.0 - share).sqrt() * own.get(col, row).unwrap()
    })
}

#[test]
fn what_neighbours_have_in_common_is_told_with_its_deviation() {
    let of = |share: f64, seed: u64| {
        let mut random = Pcg64::seed_from_u64(500 + seed);
        let mut frames = frames(&TRUTH, 6, 900 + seed);
        for frame in &mut frames {
            let noise = partly_smooth(share, 4, &mut random);
            frame.range = Raster::from_fn(SIZE[0], SIZE[1], |col, row| {
                let amplitude = f64::from(*frame.amplitude.get(col, row).unwrap());
                (2.0 + 0.01 * row as f64 + noise.get(col, row).unwrap() * TRUTH.sigma_m(amplitude, 1.0)) as f32
            });
        }
        estimate(&frames).unwrap()
    };
    let runs = 12;
    let mut squares = 0.0;
    for seed in 0..runs {
        let found = of(0.6, seed);
        let (shared, sigma) = (found.noise.shared.unwrap(), found.shared_sigma.unwrap());
        assert!((3.0..5.5).contains(&shared.width_px), "{shared:?}");
        squares += ((shared.share - 0.6) / sigma).powi(2) / runs as f64;
    }
    println!("squared error over variance of the share: {squares:.2}");
    assert!((0.3..2.5).contains(&squares), "{squares}");
    assert_eq!((0..20).filter(|seed| of(0.0, 100 + seed).noise.shared.is_some()).count(), 0);
}

#[test]
fn an_amplitude_times_squared_range_is_told_from_a_received_one() {
    let scaled = RangeNoise { amplitude_scale: AmplitudeScale::TimesSquaredRange, ..TRUTH };
    let mut random = Pcg64::seed_from_u64(21);
    let range = |col: usize, row: usize| 1.0 + 0.04 * col as f64 + 0.04 * row as f64;
    let mut one = || {
        let amplitude = |col: usize, row: usize| if (col / 5 + row / 5).is_multiple_of(2) { 500.0 } else { 2000.0 };
        RangeFrame {
            range: Raster::from_fn(SIZE[0], SIZE[1], |col, row| {
                let unit: f64 = StandardNormal.sample(&mut random);
                (range(col, row) + unit * scaled.sigma_m(amplitude(col, row), range(col, row))) as f32
            }),
            sigma: Raster::filled(SIZE[0], SIZE[1], f32::NAN),
            amplitude: Raster::from_fn(SIZE[0], SIZE[1], |col, row| amplitude(col, row) as f32),
            flags: Raster::filled(SIZE[0], SIZE[1], Flags::empty()),
        }
    };
    let frames: Vec<RangeFrame> = (0..6).map(|_| one()).collect();
    let estimate = estimate(&frames).unwrap();
    assert_eq!(estimate.noise.amplitude_scale, AmplitudeScale::TimesSquaredRange);
    let slope = &estimate.parameters()[0];
    assert!((slope.value - 2.0).abs() < 4.0 * slope.sigma, "{slope:?}");
    let plain = self::estimate(&self::frames(&TRUTH, 6, 4)).unwrap();
    assert_eq!(plain.noise.amplitude_scale, AmplitudeScale::AsReceived);
}

#[test]
fn bad_input_is_refused_by_name() {
    let mut constant = frames(&TRUTH, 4, 1);
    let answer = estimate(&constant[..1]);
    assert!(matches!(answer, Err(Error::TooFewFrames { frames: 1, .. })), "{answer:?}");
    let mut random = Pcg64::seed_from_u64(8);
    for frame in &mut constant {
        frame.amplitude = Raster::from_fn(SIZE[0], SIZE[1], |_, _| {
            let unit: f64 = StandardNormal.sample(&mut random);
            (500.0 + 5.0 * unit) as f32
        });
    }
    let answer = estimate(&constant);
    assert!(matches!(answer, Err(Error::NoisePartsNotApart { .. })), "{answer:?}");
    constant[1].amplitude = Raster::filled(SIZE[0], SIZE[1], f32::NAN);
    let answer = estimate(&constant);
    assert!(matches!(answer, Err(Error::NoAmplitudes { .. })), "{answer:?}");
    let mut unlike = frames(&TRUTH, 3, 1);
    unlike[1].range = Raster::filled(3, 3, 1.0);
    assert!(matches!(estimate(&unlike), Err(Error::Image(_))));
}
