//! A sensor whose ranges err alike in all frames: a smooth field over the image.
#![allow(dead_code, missing_docs)]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::Pinhole;

/// Standard deviations by degree, metre of range.
pub const SIGMA: [f64; 5] = [6e-3, 4e-3, 3e-3, 2e-3, 1e-3];

/// Coefficients of a field as they are drawn for one sensor, with their degrees along columns and rows.
pub fn drawn(seed: u64) -> Vec<([usize; 2], f64)> {
    let mut random = Pcg64::seed_from_u64(seed);
    let degrees = (0..SIGMA.len()).flat_map(|degree| (0..=degree).map(move |down| [degree - down, down]));
    let mut value = |sigma: f64| {
        let n: f64 = StandardNormal.sample(&mut random);
        sigma * n
    };
    degrees.map(|[across, down]| ([across, down], value(SIGMA[across + down]))).collect()
}

/// Polynomials of mean square 1 over -1 to 1, in closed form.
fn polynomial(degree: usize, x: f64) -> f64 {
    let value = match degree {
        0 => 1.0,
        1 => x,
        2 => (3.0 * x * x - 1.0) / 2.0,
        3 => (5.0 * x * x - 3.0) * x / 2.0,
        _ => ((35.0 * x * x - 30.0) * x * x + 3.0) / 8.0,
    };
    value * (2.0 * degree as f64 + 1.0).sqrt()
}

/// Adds the field to the ranges.
pub fn distort(points: &mut [[f64; 3]], camera: &Pinhole, field: &[([usize; 2], f64)]) {
    for (k, point) in points.iter_mut().enumerate() {
        let place = |index: usize, size: usize| (2 * index + 1) as f64 / size as f64 - 1.0;
        let (x, y) = (place(k % camera.width, camera.width), place(k / camera.width, camera.height));
        let error: f64 = field.iter().map(|([c, r], value)| value * polynomial(*c, x) * polynomial(*r, y)).sum();
        let range = (point[0].powi(2) + point[1].powi(2) + point[2].powi(2)).sqrt();
        *point = point.map(|v| v * (1.0 + error / range));
    }
}
