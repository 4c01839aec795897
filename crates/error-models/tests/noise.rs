//! The predicted standard deviation of a range against that of sampled frames.

use std::f64::consts::TAU;

use approx::assert_relative_eq;
use error_models::{NoiseModel, lowest_amplitude, range_sigma_m};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use range_image::{DemodulationOptions, Modulation, RawFrame, Samples, demodulate};

#[test]
fn the_predicted_sigma_is_that_of_demodulated_samples() {
    let noise = NoiseModel { shot_variance_per_unit: 0.8, dark_sigma: 6.0 };
    let modulation = Modulation::new(20e6).unwrap();
    let (offset, amplitude, phase, steps, pixels) = (900.0, 300.0, 1.3, 4, 20_000);
    let mut random = Pcg64::seed_from_u64(3);
    let mut samples = Vec::new();
    for step in 0..steps {
        let mean = offset + amplitude * (phase + TAU * f64::from(step) / f64::from(steps)).cos();
        let spread = Normal::new(mean, (0.8 * mean + 36.0_f64).sqrt()).unwrap();
        samples.extend((0..pixels).map(|_| spread.sample(&mut random) as f32));
    }
    let raw = RawFrame::new(pixels, 1, steps as usize, vec![modulation], Samples::F32(samples)).unwrap();
    let frame = demodulate(&raw, &DemodulationOptions::default()).unwrap();
    let ranges: Vec<f64> = frame.channels[0]
        .phase()
        .as_slice()
        .iter()
        .map(|phase| modulation.range_from_phase(f64::from(*phase)))
        .collect();
    let mean = ranges.iter().sum::<f64>() / pixels as f64;
    let variance = ranges.iter().map(|range| (range - mean).powi(2)).sum::<f64>() / (pixels - 1) as f64;
    let predicted = range_sigma_m(&noise, &modulation, 4, offset, amplitude);
    // The deviation of 20000 values is known to 0.5 %; four times that.
    assert_relative_eq!(variance.sqrt(), predicted, max_relative = 0.02);
    assert_relative_eq!(lowest_amplitude(&noise, &modulation, 4, offset, predicted), amplitude, max_relative = 1e-12);
}

#[test]
fn what_is_not_known_is_nan() {
    let modulation = Modulation::new(20e6).unwrap();
    let noise = NoiseModel { shot_variance_per_unit: 1.0, dark_sigma: 1.0 };
    assert!(range_sigma_m(&NoiseModel::default(), &modulation, 4, 100.0, 10.0).is_nan());
    assert!(range_sigma_m(&noise, &modulation, 4, 100.0, 0.0).is_nan());
    assert!(range_sigma_m(&noise, &modulation, 4, 100.0, f64::NAN).is_nan());
    assert!(lowest_amplitude(&noise, &modulation, 4, 100.0, -0.1).is_nan());
}
