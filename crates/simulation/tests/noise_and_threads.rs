//! The noise has the variance it is told, and the bits do not depend on threads.

use crate::common::plain;
use range_image::{NoiseModel, Samples, demodulate, sigma_from_repeats};
use scattering_deconvolution::{GaussianTerm, Psf};
use simulation::{MixedPixelsSpec, MultipathSpec, SampleType, SimulationSpec, simulate, simulate_frame};

fn noisy() -> SimulationSpec {
    let mut spec = plain();
    spec.errors.noise = Some(NoiseModel { shot_variance_per_unit: 0.05, dark_sigma: 3.0 });
    spec
}

fn values(samples: &Samples) -> Vec<f64> {
    match samples {
        Samples::F32(values) => values.iter().map(|v| f64::from(*v)).collect(),
        Samples::U16(values) => values.iter().map(|v| f64::from(*v)).collect(),
        Samples::I16(values) => values.iter().map(|v| f64::from(*v)).collect(),
    }
}

#[test]
fn each_sample_has_its_variance() {
    let clean = values(simulate_frame(&plain(), 1, 0, 0).unwrap().raw.samples());
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..8 {
        let noisy = values(simulate_frame(&noisy(), seed, 0, 0).unwrap().raw.samples());
        for (noisy, clean) in noisy.iter().zip(&clean) {
            let standardised = (noisy - clean) / (0.05 * clean + 9.0).sqrt();
            sum += standardised;
            squares += standardised * standardised;
            count += 1.0;
        }
    }
    // 55 296 standard normal values: mean known to 0.0043, variance to 0.006; four of each.
    assert!((sum / count).abs() < 0.017, "mean {}", sum / count);
    assert!((squares / count - 1.0).abs() < 0.024, "variance {}", squares / count);
}

#[test]
fn the_sigma_that_demodulation_predicts_is_the_scatter_of_frames() {
    let mut spec = noisy();
    spec.exposure.frames_per_station = 24;
    let options = spec.demodulation_options();
    let survey = simulate(&spec, 3, &|_, _| {}).unwrap();
    let complex: Vec<_> = survey.frames.iter().map(|f| demodulate(&f.raw, &options).unwrap()).collect();
    let scatter = sigma_from_repeats(&complex, 0).unwrap();
    let ratio = |i: usize| f64::from(scatter.as_slice()[i] / complex[0].channels[0].sigma.as_slice()[i]).powi(2);
    let mean = (0..scatter.len()).map(ratio).sum::<f64>() / scatter.len() as f64;
    // 1728 variances from 2 * 23 degrees of freedom: their mean is known to sqrt(2 / 46 / 1728) = 0.5 %; the predicted
    // variance itself is noisy by less. Four of these.
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
}

#[test]
fn bits_do_not_depend_on_the_number_of_threads() {
    let mut spec = noisy();
    spec.errors.mixed_pixels = Some(MixedPixelsSpec { rays_per_pixel_side: 2, threshold_m: 0.05 });
    spec.errors.multipath = Some(MultipathSpec { directions: 8, seed: 1 });
    spec.errors.scattering = Some(Psf::Gaussians(vec![GaussianTerm { weight: 0.05, sigma_px: [8.0, 8.0] }]));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| simulate(&spec, 42, &|_, _| {}).unwrap())
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one.frames[1].raw, two.frames[1].raw);
    assert_eq!(one.frames[1].truth, two.frames[1].truth);
    assert_eq!(simulate_frame(&spec, 42, 0, 1).unwrap().raw, one.frames[1].raw);
}

#[test]
fn noise_differs_between_frames_stations_and_seeds() {
    let mut spec = noisy();
    let mut other = spec.stations[0].clone();
    other.name = "B".into();
    spec.stations.push(other);
    let frame = |seed, station, frame| simulate_frame(&spec, seed, station, frame).unwrap().raw;
    let first = frame(1, 0, 0);
    for different in [frame(1, 0, 1), frame(1, 1, 0), frame(2, 0, 0)] {
        let equal = values(first.samples())
            .iter()
            .zip(values(different.samples()))
            .filter(|(a, b)| a.to_bits() == b.to_bits())
            .count();
        assert!(equal < 10, "{equal} samples are equal");
    }
}

#[test]
fn progress_counts_every_frame() {
    let seen = std::sync::Mutex::new(Vec::new());
    simulate(&plain(), 1, &|done, total| seen.lock().unwrap().push((done, total))).unwrap();
    assert_eq!(*seen.lock().unwrap(), [(1, 2), (2, 2)]);
}

#[test]
fn noise_survives_digitisation() {
    let mut spec = noisy();
    spec.errors.digitisation =
        Some(simulation::DigitisationSpec { sample_type: SampleType::U16, raw_scale: 0.25, saturation: None });
    let clean = values(simulate_frame(&plain(), 1, 0, 0).unwrap().raw.samples());
    let raw = values(simulate_frame(&spec, 5, 0, 0).unwrap().raw.samples());
    let standardised =
        raw.iter().zip(&clean).map(|(raw, clean)| ((0.25 * raw - clean) / (0.05 * clean + 9.0).sqrt()).powi(2));
    let variance = standardised.sum::<f64>() / raw.len() as f64;
    // 6912 values: known to sqrt(2 / 6912) = 1.7 %; four of these. Rounding adds 0.25^2 / 12 to 9 or more: nothing.
    assert!((variance - 1.0).abs() < 0.07, "{variance}");
}
