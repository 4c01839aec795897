//! Unwraps a noisy phase image with and without the filter, and prints `name milliseconds fraction` for each.
//!
//! `cargo run --release -p phase-unwrap --example noisy_unwrap` makes a smooth surface of 640 x 480 pixels with 1 rad
//! of noise itself; `noisy_unwrap SCENE SIGMA` takes another scene (`smooth`, `boxes`, `objects`) and noise;
//! `noisy_unwrap file PATH WIDTH HEIGHT [SIGMA]` reads little-endian f32 phases in `[0, 2 pi]` (no fraction then) and
//! writes the counts beside it as little-endian i32 to `PATH.NAME.i32`.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

use phase_unwrap::{
    CutPrice, ExactOptions, ExactUnwrapped, LeastCuts, NoisyMethod, NoisyOptions, NoisyUnwrapped, NoisyUnwrapper,
    PhaseNoise, SpatialOptions, unwrap_spatial,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

/// Unwrapped phase of a smooth surface: a paraboloid and slopes, below 0.3 rad a pixel.
fn smooth(col: f64, row: f64) -> f64 {
    40.0 + 0.11 * col + 0.05 * row - 0.000_25 * ((col - 330.0).powi(2) + (row - 210.0).powi(2))
}

/// Sixty discs and boxes of all sizes at all depths before a slanted wall: true jumps of any part of a cycle.
fn objects(col: f64, row: f64) -> f64 {
    let hash =
        |n: u32| f64::from(n.wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519)) / 2f64.powi(32);
    let mut depth = 30.0 + 0.01 * col - 0.006 * row;
    for n in 0..60 {
        let [x, y, size, off] = [0, 1, 2, 3].map(|part| hash(4 * n + part));
        let (dx, dy) = ((col - 640.0 * x).abs(), (row - 480.0 * y).abs());
        let radius = 8.0 + 40.0 * size;
        let inside = if n % 2 == 0 { dx.hypot(dy) < radius } else { dx.max(1.5 * dy) < radius };
        if inside {
            depth = 30.0 - 10.0 * off + 0.02 * (col - 640.0 * x);
        }
    }
    depth
}

/// A floor and a wall with boxes that stand off by whole and broken cycles.
fn boxes(col: f64, row: f64) -> f64 {
    let background = 6.0 + 0.004 * col + 0.02 * row.min(300.0) - 0.03 * (row - 300.0).max(0.0);
    let inside = |left: f64, top: f64| (left..left + 90.0).contains(&col) && (top..top + 110.0).contains(&row);
    let standoff: f64 =
        [(60.0, 80.0, 1.5), (250.0, 60.0, 2.6), (430.0, 90.0, 4.0), (130.0, 300.0, 5.0), (400.0, 320.0, 2.0)]
            .iter()
            .map(|&(left, top, depth)| if inside(left, top) { depth } else { 0.0 })
            .sum();
    background - standoff
}

struct Scene {
    phase: Raster<f32>,
    /// The counts that bring the measured phase to truth plus noise.
    wraps: Option<Raster<i32>>,
}

fn make(surface: fn(f64, f64) -> f64, sigma: f64, seed: u64) -> Scene {
    let mut rng = Pcg64::seed_from_u64(seed);
    let noisy = Raster::from_fn(640, 480, |col, row| {
        let noise: f64 = StandardNormal.sample(&mut rng);
        surface(col as f64, row as f64) + sigma * noise
    });
    let phase = noisy.map(|value| (value.rem_euclid(TAU) as f32).min(std::f32::consts::TAU));
    let wraps = noisy.map(|value| value.div_euclid(TAU) as i32);
    Scene { phase, wraps: Some(wraps) }
}

fn read(path: &Path, width: usize, height: usize) -> Result<Scene, Box<dyn Error>> {
    let values = std::fs::read(path)?.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    Ok(Scene { phase: Raster::from_vec(width, height, values)?, wraps: None })
}

/// Share of the pixels whose count is that of truth plus noise, after the most frequent whole offset is taken off.
fn fraction(found: &Raster<i32>, truth: &Raster<i32>) -> f64 {
    let mut counts = std::collections::BTreeMap::new();
    for (found, truth) in found.as_slice().iter().zip(truth.as_slice()) {
        *counts.entry(found - truth).or_insert(0_usize) += 1;
    }
    counts.values().copied().max().unwrap_or(0) as f64 / found.len() as f64
}

/// Least time of several runs in milliseconds, and the last result.
fn timed<T>(mut run: impl FnMut() -> T) -> (f64, T) {
    let mut least = f64::INFINITY;
    loop {
        let mut result = None;
        for _ in 0..9 {
            let start = Instant::now();
            result = Some(run());
            least = least.min(1e3 * start.elapsed().as_secs_f64());
        }
        if let Some(result) = result {
            return (least, result);
        }
    }
}

fn report(
    name: &str,
    milliseconds: f64,
    wraps: &Raster<i32>,
    scene: &Scene,
    path: Option<&Path>,
) -> Result<(), Box<dyn Error>> {
    let share = scene.wraps.as_ref().map_or(f64::NAN, |truth| fraction(wraps, truth));
    println!("{name} {milliseconds:.2} {share:.5}");
    if let Some(path) = path {
        let bytes: Vec<u8> = wraps.as_slice().iter().flat_map(|wraps| wraps.to_le_bytes()).collect();
        std::fs::write(format!("{}.{name}.i32", path.display()), bytes)?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let texts: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (scene, sigma, path) = match texts.as_slice() {
        [] => (make(smooth, 1.0, 1), Some(1.0), None),
        ["smooth", sigma] => (make(smooth, sigma.parse()?, 1), Some(sigma.parse()?), None),
        ["boxes", sigma] => (make(boxes, sigma.parse()?, 1), Some(sigma.parse()?), None),
        ["objects", sigma] => (make(objects, sigma.parse()?, 1), Some(sigma.parse()?), None),
        ["file", path, width, height, sigma @ ..] => {
            let sigma = sigma.first().map(|sigma| sigma.parse()).transpose()?;
            (read(Path::new(path), width.parse()?, height.parse()?)?, sigma, Some(Path::new(*path)))
        }
        _ => return Err("arguments: none, or SCENE SIGMA, or file PATH WIDTH HEIGHT [SIGMA]".into()),
    };
    let (time, tree) = timed(|| unwrap_spatial(&scene.phase, None, None, &SpatialOptions::default()));
    report("tree", time, &tree?.wraps, &scene, path)?;
    let mut unwrapper = NoisyUnwrapper::new(NoisyOptions::default())?;
    let mut out = NoisyUnwrapped::default();
    for (name, noise) in
        [("noisy", sigma.map_or(PhaseNoise::Unknown, PhaseNoise::Uniform)), ("noisy_estimated", PhaseNoise::Unknown)]
    {
        let (time, done) = timed(|| unwrapper.unwrap_into(&scene.phase, noise, None, &mut out));
        done?;
        report(name, time, &out.unwrapped.wraps, &scene, path)?;
        println!("# noise {:?} rad", out.filtered.noise_rad);
    }
    let noise = sigma.map_or(PhaseNoise::Unknown, PhaseNoise::Uniform);
    for (name, method) in [("noisy_exact", NoisyMethod::FilteredCuts), ("auto", NoisyMethod::Auto)] {
        let mut unwrapper = NoisyUnwrapper::new(NoisyOptions { method, ..NoisyOptions::default() })?;
        let (time, done) = timed(|| unwrapper.unwrap_into(&scene.phase, noise, None, &mut out));
        done?;
        report(name, time, &out.unwrapped.wraps, &scene, path)?;
        println!("# {:?}, {:?}", out.method, out.filtered.verdict);
    }
    for (name, price) in [("exact", CutPrice::Smoothness), ("exact_uniform", CutPrice::Uniform)] {
        let mut cuts = LeastCuts::new(ExactOptions { price, ..ExactOptions::default() });
        let mut out = ExactUnwrapped::default();
        let (time, done) = timed(|| cuts.unwrap_into(&scene.phase, None, None, &mut out));
        match done {
            Ok(()) => {
                report(name, time, &out.wraps, &scene, path)?;
                println!("# {} residues, cost {} proven", out.residues, out.cost);
            }
            Err(refused) => println!("# {name}: {refused}"),
        }
    }
    Ok(())
}
