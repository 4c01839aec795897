//! Absolute counts at one frequency on full frames: objects with true jumps, dark patches, noise that follows the light.

use std::f64::consts::TAU;

use phase_unwrap::{ImageGeometry, KnownWraps, SpatialOptions, Unwrapped, Unwrapper};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
const FOCAL_PX: f64 = 560.0;
/// Ambiguity interval, metres.
const INTERVAL_M: f64 = 5.0;
const SEEDS: u64 = 8;

struct Scene {
    phase: Raster<f32>,
    amplitude: Raster<f32>,
    wraps: Raster<i32>,
}

/// A flat or slanted rectangle in the image.
struct Object {
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
    range_m: f64,
    slope: f64,
    albedo: f64,
}

/// A floor, a wall at 6 to 9 m, ten objects at 0.8 to 6 m, and a dozen dark patches of albedo 0.05 to 0.2 that lie on
/// whatever is there. Phase noise is inverse to the amplitude: 0.02 rad at 5 m and albedo 0.6.
fn scene(seed: u64) -> Scene {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let (wall, camera_height) = (between(6.0, 9.0), between(1.2, 1.7));
    let mut rectangle = |size: (f64, f64)| {
        let (width, height) = (between(size.0, size.1) as usize, between(size.0, size.1) as usize);
        let (col, row) = (between(0.0, 600.0) as usize, between(0.0, 440.0) as usize);
        (
            col..(col + width).min(WIDTH),
            row..(row + height).min(HEIGHT),
            [between(0.0, 1.0), between(-1.0, 1.0), between(0.0, 1.0)],
        )
    };
    let objects: Vec<Object> = (0..10)
        .map(|_| {
            let (columns, rows, [near, slope, albedo]) = rectangle((50.0, 160.0));
            Object { columns, rows, range_m: 0.8 + 5.2 * near, slope: 0.001 * slope, albedo: 0.3 + 0.6 * albedo }
        })
        .collect();
    let patches: Vec<_> = (0..12).map(|_| rectangle((20.0, 70.0))).collect();
    let surface = |col: usize, row: usize| {
        let (x, y) = ((col as f64 - 319.5) / FOCAL_PX, (row as f64 - 239.5) / FOCAL_PX);
        let norm = (1.0 + x * x + y * y).sqrt();
        let floor = if y > 0.0 { camera_height / y } else { f64::INFINITY };
        let mut found = if floor < wall { (floor * norm, 0.5 * y / norm) } else { (wall * norm, 0.6 / norm) };
        for object in &objects {
            if object.columns.contains(&col) && object.rows.contains(&row) {
                let range = object.range_m + object.slope * (col as f64 - object.columns.start as f64);
                if range < found.0 {
                    found = (range, object.albedo);
                }
            }
        }
        for (columns, rows, [albedo, ..]) in &patches {
            if columns.contains(&col) && rows.contains(&row) {
                found.1 *= (0.05 + 0.15 * albedo) / 0.6;
            }
        }
        found
    };
    let mut noise_rng = Pcg64::seed_from_u64(seed + 1000);
    let gain = 4000.0;
    let sigma = 0.02 * gain * 0.6 / 25.0;
    let mut scene = Scene {
        phase: Raster::filled(WIDTH, HEIGHT, 0.0),
        amplitude: Raster::filled(WIDTH, HEIGHT, 0.0),
        wraps: Raster::filled(WIDTH, HEIGHT, 0),
    };
    for row in 0..HEIGHT {
        for col in 0..WIDTH {
            let (range, reflectance) = surface(col, row);
            let light = gain * reflectance / (range * range);
            let mut noise = || -> f64 { StandardNormal.sample(&mut noise_rng) };
            let (sin, cos) = (TAU * range / INTERVAL_M).sin_cos();
            let (re, im) = (light * cos + sigma * noise(), light * sin + sigma * noise());
            let phase = (im.atan2(re).rem_euclid(TAU) as f32).min(std::f32::consts::TAU);
            scene.phase[(col, row)] = phase;
            scene.amplitude[(col, row)] = re.hypot(im) as f32;
            scene.wraps[(col, row)] = (range / INTERVAL_M - f64::from(phase) / TAU).round() as i32;
        }
    }
    scene
}

#[derive(Default)]
struct Score {
    right: f64,
    unknown: f64,
    sure: f64,
    wrong_among_sure: f64,
    /// Pixels, and right ones, stated with a confidence of at least 0.9.
    certain: [f64; 2],
}

fn score(found: &Unwrapped, scene: &Scene, minimum_confidence: f32, score: &mut Score) {
    let pixels = found.wraps.as_slice().iter().zip(scene.wraps.as_slice()).zip(found.confidence.as_slice());
    let share = 1.0 / (WIDTH * HEIGHT) as f64 / SEEDS as f64;
    for ((found, truth), &confidence) in pixels {
        let right = f64::from(u8::from(found == truth));
        score.right += share * right;
        if confidence < minimum_confidence {
            score.unknown += share;
        } else {
            score.sure += share;
            score.wrong_among_sure += share * (1.0 - right);
        }
        if confidence >= 0.9 {
            score.certain[0] += share;
            score.certain[1] += share * right;
        }
    }
}

fn run(name: &str, options: SpatialOptions) -> Score {
    let mut unwrapper = Unwrapper::new(options).unwrap();
    let mut total = Score::default();
    for seed in 0..SEEDS {
        let scene = scene(seed);
        let found = unwrapper.unwrap(&scene.phase, Some(&scene.amplitude), None, KnownWraps::Nothing).unwrap();
        let before = (total.right, total.unknown);
        score(&found, &scene, options.minimum_confidence, &mut total);
        let [right, unknown] = [total.right - before.0, total.unknown - before.1].map(|share| share * SEEDS as f64);
        println!("{name}, scene {seed}: right {right:.4}, unknown {unknown:.4}");
    }
    println!(
        "{name}: right {:.4} of all, unknown {:.4}, wrong among the sure {:.4}; confidence 0.9: {:.4} of all, {:.4} right",
        total.right,
        total.unknown,
        total.wrong_among_sure / total.sure,
        total.certain[0],
        total.certain[1] / total.certain[0]
    );
    total
}

#[test]
fn what_is_stated_as_sure_is_right() {
    let geometry = ImageGeometry { principal_distance_px: FOCAL_PX as f32, principal_point_px: [319.5, 239.5] };
    let plain = SpatialOptions { maximum_wraps: 1, ..SpatialOptions::default() };
    let with_rays = run("with ray geometry", SpatialOptions { geometry: Some(geometry), ..plain });
    let wrong = with_rays.wrong_among_sure / with_rays.sure;
    assert!(with_rays.right > 0.985 && wrong < 0.005 && with_rays.unknown < 0.06);
    assert!(with_rays.certain[1] / with_rays.certain[0] >= 0.99);
    let alone = run("amplitude alone", plain);
    let wrong = alone.wrong_among_sure / alone.sure;
    assert!(alone.right > 0.985 && wrong < 0.005 && alone.unknown < 0.06);
    // Calibration: at least as many are right as are said to be.
    assert!(alone.certain[1] / alone.certain[0] >= 0.99);
}
