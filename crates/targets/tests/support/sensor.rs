//! What a sensor makes of light.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use range_image::Raster;

/// Values are `offset + gain · light + noise`, cut at `largest`, rounded if asked.
pub struct Sensor {
    pub gain: f64,
    pub offset: f64,
    /// Standard deviation, unit of the values.
    pub noise: f64,
    pub largest: f64,
    pub rounded: bool,
}

impl Sensor {
    /// Float amplitudes of light 1 → `gain`.
    pub fn amplitude(gain: f64, noise: f64) -> Self {
        Self { gain, offset: 0.0, noise, largest: f64::INFINITY, rounded: false }
    }

    /// 8 bit grey.
    pub fn grey(noise: f64) -> Self {
        Self { gain: 220.0, offset: 10.0, noise, largest: 255.0, rounded: true }
    }

    pub fn expose(&self, light: &Raster<f32>, seed: u64) -> Raster<f32> {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        light.map(|value| {
            let noise: f64 = StandardNormal.sample(&mut random);
            let value = (self.offset + self.gain * f64::from(*value) + self.noise * noise).min(self.largest);
            (if self.rounded { value.round().max(0.0) } else { value }) as f32
        })
    }
}
