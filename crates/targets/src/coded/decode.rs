//! The ring about a disc.
//!
//! The ellipse of the disc, made three times as large, is the outer edge of the ring: tilted views need nothing else. The ring is
//! sampled finely, the turn at which sectors are most of one colour tells where they begin, and each sector must be clearly of
//! one colour.

use range_image::Raster;

use super::codes::smallest_turn;
use super::{GROUND, RING};
use crate::circles::find::CircleSighting;
use crate::image::sampling::bilinear;

/// Samples of a sector along the ring, and those at its ends that its neighbours blur.
const SAMPLES: usize = 8;
const ENDS: usize = 2;
/// Radii of the samples in parts of the ring's width.
const ACROSS: [f64; 3] = [0.3, 0.5, 0.7];
/// How far the mean of a sector lies from the middle between disc and ground, at least, in parts of the contrast. 0.5 is full
/// contrast; light, blur and a ring that is not quite where it is expected take a half.
const LEAST_CLEARNESS: f64 = 0.2;
/// Share of the samples of the gap, of the ground and of the sectors that may be of the other colour: of the smallest rings at the
/// least contrast, noise makes one in thirty so. Twice as much lets bars through that cover two sectors, and are read as others.
const LARGEST_SHARE: f64 = 0.05;

/// A word that was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    /// The smallest of the turned words.
    pub(super) word: u32,
    /// Parameter of the ellipse where sector 0 of that word begins, radian.
    pub(super) start_rad: f64,
}

/// Reads the ring about a disc; `None` where it is none.
pub(super) fn read(image: &Raster<f32>, disc: &CircleSighting, bits: usize) -> Option<Reading> {
    // 1 for the disc's colour, 0 for the ground's.
    let colour = |angle: f64, parts: f64| {
        let ([col, row], centre) = (disc.ellipse.point(angle), disc.ellipse.centre);
        let place = [centre[0] + parts * (col - centre[0]), centre[1] + parts * (row - centre[1])];
        (f64::from(bilinear(image, place)) - disc.level) / disc.contrast
    };
    let count = bits * SAMPLES;
    let angle = |sample: usize| std::f64::consts::TAU * (sample as f64 + 0.5) / count as f64;
    let is_ground = |parts: f64| {
        let clear = (0..count).filter(|sample| colour(angle(*sample), parts) < 0.5).count();
        clear as f64 >= (1.0 - LARGEST_SHARE) * count as f64
    };
    if !(is_ground(0.5 * (1.0 + RING[0])) && is_ground(0.5 * (RING[1] + GROUND))) {
        return None;
    }
    let across = ACROSS.map(|share| RING[0] + share * (RING[1] - RING[0]));
    let ring = |sample: usize| across.map(|parts| colour(angle(sample), parts) - 0.5);
    let ring: Vec<[f64; ACROSS.len()]> = (0..count).map(ring).collect();
    let inner = |start: usize, sector: usize| {
        (ENDS..SAMPLES - ENDS).flat_map(move |k| [0, 1, 2].map(|at| [(start + sector * SAMPLES + k) % count, at]))
    };
    let sectors = |start: usize| -> Vec<f64> {
        let mean = |sector: usize| {
            let samples = inner(start, sector).map(|[sample, at]| ring[sample][at]);
            samples.sum::<f64>() / ((SAMPLES - 2 * ENDS) * ACROSS.len()) as f64
        };
        (0..bits).map(mean).collect()
    };
    let clearness = |start: usize| sectors(start).iter().map(|mean| mean.abs()).sum::<f64>();
    let start = (0..SAMPLES).max_by(|a, b| clearness(*a).total_cmp(&clearness(*b)))?;
    let means = sectors(start);
    if !means.iter().all(|mean| mean.abs() >= LEAST_CLEARNESS) {
        return None;
    }
    let differs =
        |sector: usize| inner(start, sector).filter(|[sample, at]| ring[*sample][*at] * means[sector] < 0.0).count();
    let differing: usize = (0..bits).map(differs).sum();
    if differing as f64 > LARGEST_SHARE * (bits * (SAMPLES - 2 * ENDS) * ACROSS.len()) as f64 {
        return None;
    }
    let word = (0..bits).filter(|sector| means[*sector] > 0.0).map(|sector| 1_u32 << sector).sum();
    let (word, first) = smallest_turn(word, bits);
    let start_rad = std::f64::consts::TAU * (start + first * SAMPLES) as f64 / count as f64;
    Some(Reading { word, start_rad })
}
