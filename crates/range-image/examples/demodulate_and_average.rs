//! Demodulates repeated noisy frames of a wall and shows what averaging does to the range noise.
#![allow(clippy::print_stdout)]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use range_image::{ComplexFrame, DemodulationOptions, Modulation, NoiseModel, RawFrame, Samples, average, demodulate};

const WIDTH: usize = 176;
const HEIGHT: usize = 144;
const STEPS: usize = 4;
const RANGE_M: f64 = 3.2;

fn main() -> Result<(), range_image::Error> {
    let modulation = Modulation::new(20e6)?;
    let noise = NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 5.0 };
    let options = DemodulationOptions { noise, saturation: Some(4095.0), ..DemodulationOptions::default() };
    let mut generator = Pcg64Mcg::seed_from_u64(1);
    let frames: Vec<ComplexFrame> = (0..25)
        .map(|_| demodulate(&wall(modulation, &noise, &mut generator)?, &options))
        .collect::<Result<_, range_image::Error>>()?;

    for count in [1, 5, 25] {
        let mean = average(&frames[..count])?;
        let channel = &mean.channels[0];
        let ranges: Vec<f64> =
            channel.phase().as_slice().iter().map(|&p| modulation.range_from_phase(f64::from(p))).collect();
        let squares: f64 = ranges.iter().map(|range| (range - RANGE_M).powi(2)).sum();
        let sigma = channel.sigma_range();
        let predicted = sigma.as_slice().iter().sum::<f32>() / sigma.len() as f32;
        let found = (squares / ranges.len() as f64).sqrt();
        println!("{count:2} frames: predicted sigma {:.1} mm, found {:.1} mm", predicted * 1e3, found * 1e3);
    }
    Ok(())
}

/// One raw frame of a wall that is seen at the same range and amplitude by all pixels.
fn wall(modulation: Modulation, noise: &NoiseModel, generator: &mut Pcg64Mcg) -> Result<RawFrame, range_image::Error> {
    let phase = modulation.phase_from_range(RANGE_M);
    let mut samples = Vec::with_capacity(STEPS * WIDTH * HEIGHT);
    for step in 0..STEPS {
        let angle = phase + std::f64::consts::TAU * step as f64 / STEPS as f64;
        let level = 800.0 + 300.0 * angle.cos();
        let sigma = (noise.shot_variance_per_unit * level + noise.dark_sigma.powi(2)).sqrt();
        samples.extend((0..WIDTH * HEIGHT).map(|_| {
            let deviation: f64 = StandardNormal.sample(generator);
            (level + sigma * deviation).round() as u16
        }));
    }
    RawFrame::new(WIDTH, HEIGHT, STEPS, vec![modulation], Samples::U16(samples))
}
