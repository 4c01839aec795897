//! A scene made of plain formulas: two slanted walls at a corner, boxes in front of them, ranges beyond one ambiguity
//! interval, scattered light, noise.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rangecam::imaging::range_image::{ImageFormat, Modulation, NoiseModel, RawFrame, Samples};
use rangecam::imaging::scattering_deconvolution::{GaussianTerm, Psf, Scatterer};

use super::Failure;

pub const STEPS: usize = 4;
pub const NOISE: NoiseModel = NoiseModel { shot_variance_per_unit: 0.5, dark_sigma: 4.0 };

/// Light that is scattered inside the camera: 6 % over tens of pixels.
pub fn psf() -> Psf {
    Psf::Gaussians(vec![
        GaussianTerm { weight: 0.02, sigma_px: [12.0, 12.0] },
        GaussianTerm { weight: 0.04, sigma_px: [60.0, 50.0] },
    ])
}

/// True range of a pixel in metres: 3.6 m to 9 m on the walls, 1.2 m to 4.5 m on the boxes.
pub fn true_range(format: &ImageFormat, col: usize, row: usize) -> f64 {
    let (u, v) = (col as f64 / format.width as f64, row as f64 / format.height as f64);
    let walls = if u < 0.62 { 3.6 + 6.5 * u } else { 9.0 - 7.0 * (u - 0.62) } + 0.5 * (v - 0.5);
    let boxes = [([0.08, 0.35], [0.25, 0.9], 1.2), ([0.4, 0.2], [0.55, 0.75], 2.6), ([0.7, 0.5], [0.95, 0.95], 4.2)];
    let hit = boxes
        .iter()
        .find(|([left, top], [right, bottom], _)| (*left..*right).contains(&u) && (*top..*bottom).contains(&v));
    hit.map_or(walls, |(_, _, range)| range + 0.3 * u)
}

/// Raw samples of one frequency after the other; sigma of the range is one to four centimetres on the walls.
pub fn raw_frame(format: &ImageFormat, modulations: &[Modulation]) -> Result<RawFrame, Failure> {
    let (width, height) = (format.width, format.height);
    let mut generator = Pcg64Mcg::seed_from_u64(1);
    let mut scatterer = Scatterer::new(&psf(), width, height)?;
    let mut samples = Vec::with_capacity(modulations.len() * STEPS * width * height);
    for modulation in modulations {
        let (mut re, mut im) = (Vec::with_capacity(width * height), Vec::with_capacity(width * height));
        for row in 0..height {
            for col in 0..width {
                let range = true_range(format, col, row);
                let stripe = if (col / 24 + row / 24) % 2 == 0 { 1.0 } else { 0.7 };
                let (sin, cos) = modulation.phase_from_range(range).sin_cos();
                let amplitude = 9000.0 * stripe / (range * range);
                re.push((amplitude * cos) as f32);
                im.push((amplitude * sin) as f32);
            }
        }
        scatterer.apply(&mut re, &mut im)?;
        for step in 0..STEPS {
            let (sin, cos) = (TAU * step as f64 / STEPS as f64).sin_cos();
            samples.extend(re.iter().zip(&im).map(|(re, im)| {
                let (re, im) = (f64::from(*re), f64::from(*im));
                let level = 60.0 + 1.4 * re.hypot(im) + re * cos - im * sin;
                let deviation: f64 = StandardNormal.sample(&mut generator);
                let sigma = (NOISE.shot_variance_per_unit * level.max(0.0) + NOISE.dark_sigma.powi(2)).sqrt();
                (level + sigma * deviation).round().clamp(0.0, 65_535.0) as u16
            }));
        }
    }
    Ok(RawFrame::new(width, height, STEPS, modulations.to_vec(), Samples::U16(samples))?)
}
