//! Share of right ranges and times for three sets of frequencies at three levels of noise, 512 x 424 pixels.
//!
//! Prints lines of `set sigma_rad fraction_crt fraction_kde milliseconds_crt milliseconds_kde`: each pixel alone (by the
//! Chinese remainder), and with the neighbours' kernel density. Times are the least of several runs.
//!
//! `cargo run --release -p phase-unwrap --example multi_frequency_speed`
#![allow(clippy::print_stdout)]

#[path = "../tests/common/frequencies.rs"]
mod frequencies;

use std::time::Instant;

use frequencies::{Frame, SETS, SIGMAS, Scene};
use phase_unwrap::{KernelDensityOptions, MultiFrequencyOptions, MultiUnwrapped, MultiUnwrapper};

const RUNS: usize = 15;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("set sigma_rad fraction_crt fraction_kde milliseconds_crt milliseconds_kde");
    for (name, hz) in SETS {
        for sigma in SIGMAS {
            let scene = Scene::furnished(512, 424, hz, 1);
            let frame = scene.capture(sigma, 2);
            let (crt, crt_ms) = measure(&scene, &frame, None)?;
            let (kde, kde_ms) = measure(&scene, &frame, Some(KernelDensityOptions::default()))?;
            println!("{name} {sigma} {crt:.4} {kde:.4} {crt_ms:.2} {kde_ms:.2}");
        }
    }
    Ok(())
}

/// Share of right pixels, and milliseconds.
fn measure(
    scene: &Scene,
    frame: &Frame,
    kernel: Option<KernelDensityOptions>,
) -> Result<(f64, f64), Box<dyn std::error::Error>> {
    let options = MultiFrequencyOptions { kernel, ..MultiFrequencyOptions::default() };
    let mut unwrapper = MultiUnwrapper::new(&scene.modulations, options)?;
    let mut out = MultiUnwrapped::default();
    let mut least = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        unwrapper.unwrap_into(&frame.phases, Some(&frame.sigmas), None, &mut out)?;
        least = least.min(start.elapsed().as_secs_f64());
    }
    Ok((
        scene.right(&out.range).as_slice().iter().filter(|right| **right).count() as f64 / out.range.len() as f64,
        1e3 * least,
    ))
}
