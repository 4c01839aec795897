//! Time and memory of the spanning tree, and wrap counts of images in files.
//!
//! `tree_speed` prints `scene size milliseconds bytes_per_pixel` for smooth and noisy scenes of four sizes: the least of
//! several runs on one thread. `tree_speed WIDTH HEIGHT PHASE.f32 [WRAPS.i32]` does so for an image of little-endian
//! 32-bit floats, row by row, and writes its wrap counts as little-endian 32-bit integers.
#![allow(clippy::print_stdout)]

use std::f32::consts::TAU;
use std::fs;
use std::time::Instant;

use phase_unwrap::{KnownWraps, SpatialOptions, Unwrapped, Unwrapper};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

type Answer<T> = Result<T, Box<dyn std::error::Error>>;

const SIZES: [(usize, usize); 4] = [(176, 144), (640, 480), (1024, 1024), (4096, 4096)];
/// Standard deviation of the phase, radian.
const SCENES: [(&str, f32); 2] = [("smooth", 0.02), ("noisy", 0.6)];

/// Hills on a slope, with true jumps around a box, wrapped into `[0, 2 pi]`.
fn scene(width: usize, height: usize, sigma: f32) -> Raster<f32> {
    let mut rng = Pcg64::seed_from_u64(1);
    Raster::from_fn(width, height, |col, row| {
        let (x, y) = (col as f32 / width as f32, row as f32 / height as f32);
        let hills = 9.0 * (5.0 * x).sin() * (4.0 * y).cos() + 25.0 * y;
        let near = (x - 0.3).abs() < 0.1 && (y - 0.5).abs() < 0.15;
        let noise: f32 = StandardNormal.sample(&mut rng);
        (if near { 2.0 + x } else { hills } + sigma * noise).rem_euclid(TAU).min(TAU)
    })
}

fn read(path: &str, width: usize, height: usize) -> Answer<Raster<f32>> {
    let bytes = fs::read(path)?;
    let values = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    Ok(Raster::from_vec(width, height, values)?)
}

/// Least time in milliseconds, and bytes a pixel that the unwrapper keeps.
fn time(phase: &Raster<f32>, out: &mut Unwrapped) -> Answer<(f64, f64)> {
    let mut unwrapper = Unwrapper::new(SpatialOptions::default())?;
    let runs = (40_000_000 / phase.len().max(1)).clamp(3, 200);
    let mut least = f64::INFINITY;
    for _ in 0..runs {
        let start = Instant::now();
        unwrapper.unwrap_into(phase, None, None, KnownWraps::Nothing, out)?;
        least = least.min(1e3 * start.elapsed().as_secs_f64());
    }
    Ok((least, unwrapper.bytes() as f64 / phase.len() as f64))
}

fn main() -> Answer<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut out = Unwrapped::default();
    if let [width, height, path, rest @ ..] = arguments.as_slice() {
        let phase = read(path, width.parse()?, height.parse()?)?;
        let (milliseconds, bytes) = time(&phase, &mut out)?;
        println!("file {width}x{height} {milliseconds:.3} {bytes:.1}");
        if let [wraps] = rest {
            fs::write(wraps, out.wraps.as_slice().iter().flat_map(|count| count.to_le_bytes()).collect::<Vec<u8>>())?;
        }
        return Ok(());
    }
    for (name, sigma) in SCENES {
        for (width, height) in SIZES {
            let (milliseconds, bytes) = time(&scene(width, height, sigma), &mut out)?;
            println!("{name} {width}x{height} {milliseconds:.3} {bytes:.1}");
        }
    }
    Ok(())
}
