//! Scenes for several frequencies: a room as long as the combined interval, boxes with jumps, wires, noise that grows
//! with the square of the range as the amplitude falls.
#![allow(dead_code, clippy::expect_used)]

use std::f64::consts::TAU;

use phase_unwrap::combined_interval_m;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{Modulation, Raster};

/// Frequencies in hertz.
pub const SETS: [(&str, &[f64]); 3] =
    [("80/60", &[80e6, 60e6]), ("100/80", &[100e6, 80e6]), ("80/16/120", &[80e6, 16e6, 120e6])];
/// Standard deviations of the phase at the far end of the scene, radians.
pub const SIGMAS: [f64; 3] = [0.1, 0.3, 0.6];
/// Principal distance as a share of the width: that of a Kinect.
const FOCAL: f64 = 365.0 / 512.0;
/// Largest range of the room as a share of the combined interval.
const FAR: f64 = 0.93;

pub struct Scene {
    pub modulations: Vec<Modulation>,
    pub range_m: Raster<f64>,
    /// Width in pixels of the wire that a pixel lies on; 0 elsewhere.
    pub wire: Raster<u8>,
    /// Range at which the noise is the one asked for.
    far_m: f64,
}

pub struct Frame {
    pub phases: Vec<Raster<f32>>,
    pub sigmas: Vec<Raster<f32>>,
}

pub fn modulations(hz: &[f64]) -> Vec<Modulation> {
    hz.iter().map(|&hz| Modulation::new(hz).expect("a frequency")).collect()
}

impl Scene {
    /// Walls, floor and ceiling.
    fn room(width: usize, height: usize, hz: &[f64]) -> Self {
        let modulations = modulations(hz);
        let limit = combined_interval_m(&modulations).expect("frequencies that combine");
        let focal = FOCAL * width as f64;
        let size = limit / 7.5;
        let range_m = Raster::from_fn(width, height, |col, row| {
            let x = (col as f64 - (width as f64 - 1.0) / 2.0) / focal;
            let y = ((height as f64 - 1.0) / 2.0 - row as f64) / focal;
            let wall = if x > 0.0 { 2.2 * size / x } else { 1.8 * size / x.abs() };
            let floor = if y > 0.0 { 1.3 * size / y } else { 1.2 * size / y.abs() };
            wall.min(floor).min(0.82 * limit) * (1.0 + x * x + y * y).sqrt()
        });
        Self { modulations, range_m, wire: Raster::filled(width, height, 0), far_m: FAR * limit }
    }

    /// The room with ten boxes at ranges of their own.
    pub fn furnished(width: usize, height: usize, hz: &[f64], seed: u64) -> Self {
        let mut scene = Self::room(width, height, hz);
        let mut rng = Pcg64::seed_from_u64(seed);
        let (w, h) = (width as f64, height as f64);
        for _ in 0..10 {
            let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
            let (col, row) = (between(0.0, 0.9) * w, between(0.0, 0.9) * h);
            let (right, bottom) = (col + between(0.04, 0.2) * w, row + between(0.04, 0.2) * h);
            let range = between(0.12, 0.75) * scene.far_m;
            // A face that recedes by up to a tenth from one side to the other.
            let slope = between(-0.1, 0.1);
            for row in row as usize..(bottom as usize).min(height) {
                for col in col as usize..(right as usize).min(width) {
                    let face = range * (1.0 + slope * (col as f64 / w - 0.5));
                    let at = &mut scene.range_m[(col, row)];
                    *at = at.min(face);
                }
            }
        }
        scene
    }

    /// The room behind upright wires of one to three pixels.
    pub fn wired(width: usize, height: usize, hz: &[f64], seed: u64) -> Self {
        let mut scene = Self::room(width, height, hz);
        let mut rng = Pcg64::seed_from_u64(seed);
        for (number, first) in (8..width - 8).step_by(13).enumerate() {
            let thickness = number % 3 + 1;
            let share = 0.15 + 0.7 * rng.random::<f64>();
            let lean = 0.1 * (rng.random::<f64>() - 0.5);
            let nearest = (0..height).map(|row| scene.range_m[(first, row)]).fold(f64::INFINITY, f64::min);
            for row in 0..height {
                let col = (first as f64 + lean * (row as f64 - height as f64 / 2.0)) as usize;
                for col in col..(col + thickness).min(width) {
                    scene.range_m[(col, row)] = share * nearest;
                    scene.wire[(col, row)] = thickness as u8;
                }
            }
        }
        scene
    }

    /// Every pixel at a range of its own: no neighbour tells anything.
    pub fn scattered(width: usize, height: usize, hz: &[f64], seed: u64) -> Self {
        let mut scene = Self::room(width, height, hz);
        let mut rng = Pcg64::seed_from_u64(seed);
        scene.range_m = scene.range_m.map(|_| scene.far_m * (0.05 + 0.95 * rng.random::<f64>()));
        scene
    }

    /// Phases with normal noise, whose deviation grows with the square of the range up to `sigma_rad`; wires are dark,
    /// with half of it at least.
    pub fn capture(&self, sigma_rad: f64, seed: u64) -> Frame {
        let mut rng = Pcg64::seed_from_u64(seed);
        let (width, height) = (self.range_m.width(), self.range_m.height());
        let sigma = Raster::from_fn(width, height, |col, row| {
            let relative = (self.range_m[(col, row)] / self.far_m).powi(2);
            sigma_rad * if self.wire[(col, row)] > 0 { relative.max(0.5) } else { relative }
        });
        let phases = self.modulations.iter().map(|modulation| {
            Raster::from_fn(width, height, |col, row| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let phase = modulation.phase_from_range(self.range_m[(col, row)]) + sigma[(col, row)] * noise;
                (phase.rem_euclid(TAU) as f32).min(std::f32::consts::TAU)
            })
        });
        let phases = phases.collect();
        Frame { phases, sigmas: self.modulations.iter().map(|_| sigma.map(|&sigma| sigma as f32)).collect() }
    }

    /// Pixels whose range lies within three tenths of the shortest interval of the truth: wrong counts differ by more,
    /// noise by less.
    pub fn right(&self, range: &Raster<f32>) -> Raster<bool> {
        let intervals = self.modulations.iter().map(Modulation::ambiguity_interval_m);
        let tolerance = 0.3 * intervals.fold(f64::INFINITY, f64::min);
        Raster::from_fn(range.width(), range.height(), |col, row| {
            (f64::from(range[(col, row)]) - self.range_m[(col, row)]).abs() < tolerance
        })
    }
}
