//! Noisy fringes of known counts: ramps in all directions, hills, jumps and holes.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Raster;

/// Wrapped phase of a surface with noise, NaN where there is a hole, and the counts of truth plus noise.
pub struct Fringes {
    /// Radians in `[0, 2 pi]`.
    pub phase: Raster<f32>,
    /// What a user would get by measuring without wrapping.
    pub wraps: Raster<i32>,
}

/// Unwrapped phase in radians at a column and a row; NaN is a hole.
pub type Surface<'a> = dyn Fn(f64, f64) -> f64 + 'a;

impl Fringes {
    /// A surface under normal noise of `sigma_rad`.
    pub fn new(size: [usize; 2], surface: &Surface<'_>, sigma_rad: f64, seed: u64) -> Self {
        let mut rng = Pcg64::seed_from_u64(seed);
        let noisy = Raster::from_fn(size[0], size[1], |col, row| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            surface(col as f64, row as f64) + sigma_rad * noise
        });
        // The smaller of NaN and a number is the number: `clamp` keeps NaN.
        let phase = noisy.map(|value| (value.rem_euclid(TAU) as f32).clamp(0.0, std::f32::consts::TAU));
        Self { phase, wraps: noisy.map(|value| value.div_euclid(TAU) as i32) }
    }

    /// Share of the pixels outside holes whose count is right, up to the whole offset of most of them.
    pub fn right(&self, found: &Raster<i32>) -> f64 {
        let mut offsets = BTreeMap::new();
        let pixels = found.as_slice().iter().zip(self.wraps.as_slice()).zip(self.phase.as_slice());
        for ((found, truth), _) in pixels.filter(|(_, phase)| phase.is_finite()) {
            *offsets.entry(found - truth).or_insert(0_usize) += 1;
        }
        let used: usize = offsets.values().sum();
        offsets.values().copied().max().unwrap_or(0) as f64 / used.max(1) as f64
    }
}

/// A plane that rises by `slope` radians a pixel in the direction of `direction_deg`.
pub fn ramp(slope: f64, direction_deg: f64) -> impl Fn(f64, f64) -> f64 {
    let (sine, cosine) = direction_deg.to_radians().sin_cos();
    move |col, row| 7.3 + slope * (cosine * col + sine * row)
}

/// A hill whose slopes grow from nothing in the middle to `slope` radians a pixel at `radius` pixels.
pub fn hill(slope: f64, centre: [f64; 2], radius: f64) -> impl Fn(f64, f64) -> f64 {
    move |col, row| 5.1 - 0.5 * slope / radius * ((col - centre[0]).powi(2) + (row - centre[1]).powi(2))
}
