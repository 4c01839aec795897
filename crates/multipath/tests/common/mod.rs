//! Complex frames of given paths, with seeded noise.
#![allow(dead_code, clippy::unwrap_used)]

use multipath::Systematics;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::{ComplexChannel, ComplexFrame, Flags, Modulation, Raster};

/// Amplitude (before the contrast) and range in metre of one path.
pub type Path = (f64, f64);

/// Three frequencies that repeat together after 15 m.
pub const THREE: [f64; 3] = [20e6, 50e6, 80e6];
/// A sensor's contrast at them.
pub const CONTRAST: [f64; 3] = [1.0, 0.8, 0.6];

pub const NO_SYSTEMATICS: Systematics = Systematics::NONE;

pub fn modulations(frequencies_hz: &[f64]) -> Vec<Modulation> {
    frequencies_hz.iter().map(|f| Modulation::new(*f).unwrap()).collect()
}

/// A frame whose pixel `index` (row by row) sees `paths(index)`; each part of z has noise `sigma`.
pub fn frame(
    [width, height]: [usize; 2],
    frequencies_hz: &[f64],
    contrast: &[f64],
    sigma: f64,
    seed: u64,
    paths: impl Fn(usize) -> Vec<Path>,
) -> ComplexFrame {
    let mut random = Pcg64::seed_from_u64(seed);
    let channels = modulations(frequencies_hz).into_iter().zip(contrast).map(|(modulation, contrast)| {
        let (mut real, mut imaginary) = (Vec::new(), Vec::new());
        for index in 0..width * height {
            let mut noise = || {
                let n: f64 = StandardNormal.sample(&mut random);
                sigma * n
            };
            let [re, im] = sum(&modulation, &paths(index));
            real.push((contrast * re + noise()) as f32);
            imaginary.push((contrast * im + noise()) as f32);
        }
        ComplexChannel {
            modulation,
            real: Raster::from_vec(width, height, real).unwrap(),
            imaginary: Raster::from_vec(width, height, imaginary).unwrap(),
            offset: None,
            sigma: Raster::filled(width, height, sigma as f32),
        }
    });
    ComplexFrame { channels: channels.collect(), flags: Raster::filled(width, height, Flags::empty()) }
}

fn sum(modulation: &Modulation, paths: &[Path]) -> [f64; 2] {
    paths.iter().fold([0.0; 2], |[re, im], (amplitude, range)| {
        let (sin, cos) = modulation.phase_from_range(*range).sin_cos();
        [re + amplitude * cos, im + amplitude * sin]
    })
}

/// A number between 0 and 1 that `index` and `salt` decide, evenly spread over the indices.
pub fn spread(index: usize, salt: u64) -> f64 {
    let mut x = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(salt << 32);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The range at which all frequencies together agree best, as an unwrapper would deliver it: with one path the truth,
/// with more the maximum of the matched filter.
pub fn matched_range(frame: &ComplexFrame, contrast: &[f64], span_m: f64) -> Raster<f32> {
    let k: Vec<f64> = frame.channels.iter().map(|c| c.modulation.phase_from_range(1.0)).collect();
    Raster::from_fn(frame.width(), frame.height(), |col, row| {
        let projection = |range: f64| -> f64 {
            let at = |f: usize| {
                let channel = &frame.channels[f];
                let (sin, cos) = (k[f] * range).sin_cos();
                contrast[f]
                    * (f64::from(channel.real[(col, row)]) * cos + f64::from(channel.imaginary[(col, row)]) * sin)
            };
            (0..k.len()).map(at).sum()
        };
        let best = |from: f64, step: f64, count: usize| {
            let steps = (0..count).map(|i| from + step * i as f64);
            steps.max_by(|a, b| projection(*a).total_cmp(&projection(*b))).unwrap()
        };
        let coarse = best(0.0, 0.04, (span_m / 0.04) as usize);
        best(coarse - 0.05, 0.001, 100) as f32
    })
}
