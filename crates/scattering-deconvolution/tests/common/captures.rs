//! Simulated captures with and without a bright object.
#![allow(dead_code)]

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, Raster};
use scattering_deconvolution::{EstimationOptions, GaussianTerm, Psf, PsfEstimate, Scatterer, estimate_psf};

/// A bright rectangle in front of a dim, textured background.
#[derive(Debug, Clone, Copy)]
pub struct Object {
    /// First and one past the last column.
    pub columns: [usize; 2],
    pub rows: [usize; 2],
    pub range_m: f64,
    pub amplitude: f64,
}

#[derive(Debug, Clone, Copy)]
pub struct Scene {
    pub size: [usize; 2],
    pub wall_m: f64,
    pub wall_amplitude: f64,
    pub frequency_hz: f64,
    /// Standard deviation of each part of an averaged frame at the wall; brighter light has shot noise.
    pub noise: f64,
}

impl Scene {
    pub fn small() -> Self {
        Self { size: [64, 48], wall_m: 3.5, wall_amplitude: 80.0, frequency_hz: 20e6, noise: 0.5 }
    }

    pub fn camera() -> Self {
        Self { size: [176, 144], ..Self::small() }
    }

    /// Light of the scene without scattering: amplitude and range.
    pub fn light(&self, object: Option<&Object>, col: usize, row: usize) -> (f64, f64) {
        if let Some(object) = object {
            let inside = (object.columns[0]..object.columns[1]).contains(&col)
                && (object.rows[0]..object.rows[1]).contains(&row);
            if inside {
                // A reflectance that is nowhere the same.
                let shade = 1.0 + 0.25 * (col as f64 * 0.7).sin() * (row as f64 * 0.4).cos();
                return (object.amplitude * shade, object.range_m + 0.001 * col as f64);
            }
        }
        let texture = 1.0 + 0.3 * ((col / 5 + row / 7) % 2) as f64;
        (self.wall_amplitude * texture, self.wall_m + 0.3 * col as f64 / self.size[0] as f64)
    }

    pub fn modulation(&self) -> Modulation {
        Modulation::new(self.frequency_hz).unwrap()
    }

    /// A frame as a camera with this point spread function sees it.
    pub fn frame(&self, object: Option<&Object>, psf: &Psf, seed: u64) -> ComplexFrame {
        self.frame_with(|col, row| self.light(object, col, row), psf, seed)
    }

    pub fn frame_with(&self, light: impl Fn(usize, usize) -> (f64, f64), psf: &Psf, seed: u64) -> ComplexFrame {
        let [width, height] = self.size;
        let modulation = self.modulation();
        let part = |of: fn(f64) -> f64| {
            Raster::from_fn(width, height, |col, row| {
                let (amplitude, range) = light(col, row);
                (amplitude * of(modulation.phase_from_range(range))) as f32
            })
        };
        let (mut real, mut imaginary) = (part(f64::cos), part(f64::sin));
        let mut scatterer = Scatterer::new(psf, width, height).unwrap();
        scatterer.apply(real.as_mut_slice(), imaginary.as_mut_slice()).unwrap();
        let variance = |amplitude: f64| (self.noise.powi(2) * (1.0 + amplitude / self.wall_amplitude)) / 2.0;
        let sigma = Raster::from_fn(width, height, |c, r| {
            variance(f64::from(real[(c, r)].hypot(imaginary[(c, r)]))).sqrt() as f32
        });
        let mut generator = Pcg64Mcg::seed_from_u64(seed);
        for (pixel, sigma) in sigma.as_slice().iter().enumerate() {
            for plane in [&mut real, &mut imaginary] {
                let normal: f32 = StandardNormal.sample(&mut generator);
                plane.as_mut_slice()[pixel] += sigma * normal;
            }
        }
        let channel = ComplexChannel { modulation, real, imaginary, offset: None, sigma };
        ComplexFrame { channels: vec![channel], flags: Raster::filled(width, height, Flags::empty()) }
    }

    /// With and without the object.
    pub fn pair(&self, object: &Object, psf: &Psf, seed: u64) -> (ComplexFrame, ComplexFrame) {
        (self.frame(Some(object), psf, 2 * seed), self.frame(None, psf, 2 * seed + 1))
    }
}

pub fn round(terms: &[(f64, f64)]) -> Psf {
    Psf::Gaussians(terms.iter().map(|&(weight, s)| GaussianTerm { weight, sigma_px: [s, s] }).collect())
}

pub fn elliptic(weight: f64, sigma_px: [f64; 2]) -> Psf {
    Psf::Gaussians(vec![GaussianTerm { weight, sigma_px }])
}

pub fn estimate(pairs: &[(ComplexFrame, ComplexFrame)], options: &EstimationOptions) -> PsfEstimate {
    let captures: Vec<_> = pairs.iter().map(|(with, without)| (with, without)).collect();
    estimate_psf(&captures, options).unwrap()
}
