//! Times the demodulation of a frame of 640 x 480 pixels with four samples, for comparisons with other programs.
//!
//! Prints lines `name milliseconds`: the least time of many runs on one thread. Other sizes: two arguments, columns and
//! rows.
#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::time::Instant;

use range_image::{
    ComplexFrame, DemodulationOptions, Demodulator, Modulation, NoiseModel, PolarChannel, RawFrame, Samples,
};

const RUNS: usize = 300;

fn main() -> Result<(), range_image::Error> {
    let mut sizes = std::env::args().skip(1).filter_map(|argument| argument.parse::<usize>().ok());
    let (width, height) = (sizes.next().unwrap_or(640), sizes.next().unwrap_or(480));
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(|| measure(width, height)),
        Err(_) => measure(width, height),
    }
}

fn measure(width: usize, height: usize) -> Result<(), range_image::Error> {
    let demodulator = Demodulator::new(&DemodulationOptions {
        saturation: Some(4095.0),
        low_amplitude: Some(10.0),
        noise: NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 3.0 },
        ..DemodulationOptions::default()
    })?;
    let values: Vec<u16> = (0..4 * width * height).map(|i| (i * 7919 % 4001) as u16).collect();
    let centred = |v: &u16| *v as i16 - 2000;
    let kinds = [
        ("f32", Samples::F32(values.iter().map(|&v| f32::from(v)).collect())),
        ("i16", Samples::I16(values.iter().map(centred).collect())),
        ("u16", Samples::U16(values)),
    ];
    for (kind, samples) in kinds {
        let frame = RawFrame::new(width, height, 4, vec![Modulation::new(20e6)?], samples)?;
        let mut complex = ComplexFrame::empty();
        report(&format!("demodulate_{kind}"), || demodulator.demodulate_into(black_box(&frame), &mut complex))?;
        let mut polar: Vec<PolarChannel> = Vec::new();
        report(&format!("samples_to_phase_and_amplitude_{kind}"), || {
            demodulator.phase_and_amplitude_into(black_box(&frame), &mut polar);
            Ok(())
        })?;
        let Some(channel) = complex.channels.first() else { continue };
        let (mut phase, mut amplitude) = (channel.real.clone(), channel.real.clone());
        report(&format!("z_to_phase_{kind}"), || black_box(channel).phase_into(&mut phase))?;
        report(&format!("z_to_phase_and_amplitude_{kind}"), || {
            black_box(channel).phase_and_amplitude_into(&mut phase, &mut amplitude)
        })?;
    }
    Ok(())
}

fn report(name: &str, mut work: impl FnMut() -> Result<(), range_image::Error>) -> Result<(), range_image::Error> {
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        work()?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    println!("{name} {:.4}", least * 1e3);
    Ok(())
}
