//! A smooth surface under noise of one radian.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

use crate::{Outcome, Size, files};

/// Slopes stay below 0.25 rad a pixel at every size: the surface grows with the image.
pub fn write([width, height]: Size, folder: &str) -> Outcome {
    let mut rng = Pcg64::seed_from_u64(7);
    let scale = width as f64;
    let mut plane = |noise: f64| {
        let mut sample = || -> f64 { StandardNormal.sample(&mut rng) };
        Raster::from_fn(width, height, |col, row| {
            surface(col as f64 / scale, row as f64 / scale) * scale + noise * sample()
        })
    };
    let (truth, noisy) = (plane(0.0), plane(1.0));
    let phase = noisy.map(|phase| (phase.rem_euclid(TAU) as f32).min(std::f32::consts::TAU));
    let single = |plane: &Raster<f64>| plane.map(|value| *value as f32);
    files::write(folder, "phase.f32", &phase)?;
    files::write(folder, "truth.f32", &single(&truth))?;
    files::write(folder, "noisy.f32", &single(&noisy))
}

/// Height of the surface; its unit and that of the position is the image's width.
fn surface(x: f64, y: f64) -> f64 {
    let hill =
        |cx: f64, cy: f64, size: f64| size * (-((x - cx).powi(2) + (y - cy).powi(2)) / (2.0 * size * size)).exp();
    0.05 * x + 0.2 * hill(0.3, 0.3, 0.12) - 0.15 * hill(0.7, 0.45, 0.1) + 0.01 * (6.0 * x + 9.0 * y).sin()
}
