//! Scenes, point spread functions and a direct convolution to compare with.
#![allow(dead_code)]

use std::f64::consts::TAU;

use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, PhaseConvention, Raster};
use scattering_deconvolution::{GaussianTerm, Psf};

pub fn modulation() -> Modulation {
    Modulation::new(20e6).unwrap()
}

/// A wall at 4 m with a texture, and a bright object at 0.8 m that the left and the lower border cut.
pub fn scene(width: usize, height: usize) -> (Raster<f32>, Raster<f32>) {
    let is_object = |col: usize, row: usize| 3 * col < width && 2 * row > height;
    let range =
        Raster::from_fn(
            width,
            height,
            |col, row| {
                if is_object(col, row) { 0.8 } else { 4.0 + 0.5 * col as f32 / width as f32 }
            },
        );
    let amplitude = Raster::from_fn(width, height, |col, row| {
        let texture = 1.0 + 0.3 * ((col / 5 + row / 7) % 2) as f32;
        if is_object(col, row) { 2000.0 * texture } else { 60.0 * texture }
    });
    (range, amplitude)
}

pub fn frame(range: &Raster<f32>, amplitude: &Raster<f32>) -> ComplexFrame {
    let phase = range.map(|&range| modulation().phase_from_range(f64::from(range)) as f32);
    let convention = PhaseConvention::default();
    ComplexFrame::from_phase(vec![modulation()], vec![phase], vec![amplitude.clone()], &convention).unwrap()
}

/// Largest and mean absolute error of the range over all pixels, metres.
pub fn range_errors(channel: &ComplexChannel, truth: &Raster<f32>) -> (f64, f64) {
    let phase = channel.phase();
    let errors: Vec<f64> = phase
        .as_slice()
        .iter()
        .zip(truth.as_slice())
        .map(|(&phase, &range)| {
            let turn = (f64::from(phase) - modulation().phase_from_range(f64::from(range))).rem_euclid(TAU);
            modulation().range_from_phase(turn.min(TAU - turn))
        })
        .collect();
    (errors.iter().copied().fold(0.0, f64::max), errors.iter().sum::<f64>() / errors.len() as f64)
}

pub fn gaussians(terms: &[(f64, f64, f64)]) -> Psf {
    let term = |&(weight, across, down): &(f64, f64, f64)| GaussianTerm { weight, sigma_px: [across, down] };
    Psf::Gaussians(terms.iter().map(term).collect())
}

/// A kernel that is neither symmetric nor smooth, scattering `weight` in all.
pub fn rough_kernel(width: usize, height: usize, weight: f64) -> Psf {
    let raw: Vec<f64> = (0..width * height).map(|i| (1 + i * 7 % 11) as f64).collect();
    let sum: f64 = raw.iter().sum();
    Psf::Kernel { width, height, values: raw.iter().map(|value| weight * value / sum).collect() }
}

/// `z + psf * z` by the definition, in double precision.
pub fn scattered_directly(psf: &Psf, width: usize, height: usize, plane: &[f32]) -> Vec<f64> {
    let kernel = psf.sample([width - 1, height - 1]).unwrap();
    let mut out: Vec<f64> = plane.iter().map(|&value| f64::from(value)).collect();
    for row in 0..height {
        for col in 0..width {
            for ([dc, dr], weight) in kernel.entries() {
                let (c, r) = (col as isize + dc, row as isize + dr);
                if (0..width as isize).contains(&c) && (0..height as isize).contains(&r) {
                    out[r as usize * width + c as usize] += weight * f64::from(plane[row * width + col]);
                }
            }
        }
    }
    out
}

/// A frame without flags from planes.
pub fn channel(width: usize, height: usize, re: Vec<f32>, im: Vec<f32>, sigma: f32) -> ComplexChannel {
    ComplexChannel {
        modulation: modulation(),
        real: Raster::from_vec(width, height, re).unwrap(),
        imaginary: Raster::from_vec(width, height, im).unwrap(),
        offset: None,
        sigma: Raster::filled(width, height, sigma),
    }
}

pub fn no_flags(width: usize, height: usize) -> Raster<Flags> {
    Raster::filled(width, height, Flags::empty())
}
