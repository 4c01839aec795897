//! What `cargo xtask peers phase` measures of this crate: demodulation of four samples a pixel.
//!
//! `peers_demodulate WIDTH HEIGHT FOLDER` reads samples.u16 and samples.f32 (numbers in the machine's own order), writes
//! the phases `phase_u16.f32` and `phase_f32.f32`, and prints the least CPU time of this thread in milliseconds (Linux).
#![allow(clippy::print_stdout)]

#[path = "../../../xtask/peers/cpu_clock.rs"]
mod cpu_clock;

use std::error::Error;
use std::path::Path;

use cpu_clock::cpu_seconds;
use range_image::{ComplexFrame, DemodulationOptions, Demodulator, Modulation, NoiseModel, Raster, RawFrame, Samples};

const RUNS: usize = 200;

type Outcome = Result<(), Box<dyn Error + Send + Sync>>;

fn main() -> Outcome {
    // One thread, so that its CPU time is all there is.
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(run)
}

fn run() -> Outcome {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [width, height, folder] = words.as_slice() else {
        return Err("usage: peers_demodulate WIDTH HEIGHT FOLDER".into());
    };
    let (size, folder) = ([width.parse()?, height.parse()?], Path::new(folder));
    let whole = std::fs::read(folder.join("samples.u16"))?;
    let whole = whole.as_chunks().0.iter().map(|&bytes| u16::from_ne_bytes(bytes)).collect();
    let single = std::fs::read(folder.join("samples.f32"))?;
    let single = single.as_chunks().0.iter().map(|&bytes| f32::from_ne_bytes(bytes)).collect();
    measure("u16", Samples::U16(whole), size, folder)?;
    measure("f32", Samples::F32(single), size, folder)
}

fn measure(kind: &str, samples: Samples, [width, height]: [usize; 2], folder: &Path) -> Outcome {
    let raw = RawFrame::new(width, height, 4, vec![Modulation::new(20e6)?], samples)?;
    // All that a camera's description would give: sigma and flags are computed too.
    let demodulator = Demodulator::new(&DemodulationOptions {
        saturation: Some(4095.0),
        low_amplitude: Some(10.0),
        noise: NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 3.0 },
        ..DemodulationOptions::default()
    })?;
    let mut frame = ComplexFrame::empty();
    println!("{kind} {}", least(|| demodulator.demodulate_into(&raw, &mut frame))?);
    let channel = &frame.channels[0];
    let (mut phase, mut amplitude) = (Raster::filled(width, height, 0.0), Raster::filled(width, height, 0.0));
    println!("polar {}", least(|| channel.phase_and_amplitude_into(&mut phase, &mut amplitude))?);
    let mut planes = Vec::new();
    let straight = || {
        demodulator.phase_and_amplitude_into(&raw, &mut planes);
        Ok::<_, range_image::Error>(())
    };
    println!("straight_{kind} {}", least(straight)?);
    let phase = &planes[0].phase;
    let bytes: Vec<u8> = phase.as_slice().iter().flat_map(|value| value.to_ne_bytes()).collect();
    Ok(std::fs::write(folder.join(format!("phase_{kind}.f32")), bytes)?)
}

/// Least CPU time in milliseconds.
fn least<E>(mut work: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let start = cpu_seconds();
        work()?;
        least = least.min(1e3 * (cpu_seconds() - start));
    }
    Ok(least)
}
