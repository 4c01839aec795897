//! The ring about a disc.
//!
//! The ellipse of the disc, made three times as large, is the outer edge of the ring: tilted views need nothing else. The ring is
//! sampled finely, the turn at which sectors are most of one colour tells where they begin, and the colour of each is that of its
//! middle. Whether it is a ring at all says [`super::model`].

use range_image::Raster;

use super::RING;
use super::codes::smallest_turn;
use crate::circles::find::CircleSighting;
use crate::image::normal_table::NormalTable;
use crate::image::sampling::bilinear;

/// Samples of a sector along the ring, and those at its ends that its neighbours blur.
const SAMPLES: usize = 8;
const ENDS: usize = 2;
/// Radii of the samples in parts of the ring's width.
const ACROSS: [f64; 3] = [0.3, 0.5, 0.7];
/// How far the mean of a sector lies from the middle between disc and ground, at least, in parts of the contrast. 0.5 is full
/// contrast; narrow sectors lose most of it to their neighbours.
const LEAST_CLEARNESS: f64 = 0.05;

/// Width of a sector at its narrowest, in deviations of the blur with that of a pixel, from which on a ring is read: in narrower ones a
/// grey blot lifts one sector and dims another by what tells their colours apart, and makes another code.
const LEAST_WIDTH_BLURS: f64 = 2.9;

/// A word that was read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reading {
    /// The smallest of the turned words.
    pub(super) word: u32,
    /// Parameter of the ellipse where sector 0 of that word begins, radian.
    pub(super) start_rad: f64,
}

/// Reads the ring about a disc; `None` where a sector is of no colour, or narrower than the blur lets be told.
pub(super) fn read(image: &Raster<f32>, disc: &CircleSighting, bits: usize) -> Option<Reading> {
    let narrowest = std::f64::consts::PI * (RING[0] + RING[1]) / bits as f64 * disc.ellipse.semi_axes_px[1];
    if narrowest < LEAST_WIDTH_BLURS * whole_blur(disc) {
        return None;
    }
    // 1 for the disc's colour, 0 for the ground's, what the blur takes across the ring given back.
    let colour = |angle: f64, parts: f64| {
        let ([col, row], centre) = (disc.ellipse.point(angle), disc.ellipse.centre);
        let place = [centre[0] + parts * (col - centre[0]), centre[1] + parts * (row - centre[1])];
        (f64::from(bilinear(image, place)) - disc.level) / (disc.contrast * left_by_blur(disc, parts))
    };
    let count = bits * SAMPLES;
    let angle = |sample: usize| std::f64::consts::TAU * (sample as f64 + 0.5) / count as f64;
    let across = ACROSS.map(|share| RING[0] + share * (RING[1] - RING[0]));
    let sample = |sample: usize| across.map(|parts| colour(angle(sample), parts) - 0.5).iter().sum::<f64>();
    let ring: Vec<f64> = (0..count).map(|k| sample(k) / ACROSS.len() as f64).collect();
    let sectors = |start: usize| -> Vec<f64> {
        let inner = |sector: usize| (ENDS..SAMPLES - ENDS).map(move |k| (start + sector * SAMPLES + k) % count);
        let mean = |sector: usize| inner(sector).map(|k| ring[k]).sum::<f64>() / (SAMPLES - 2 * ENDS) as f64;
        (0..bits).map(mean).collect()
    };
    let clearness = |start: usize| sectors(start).iter().map(|mean| mean.abs()).sum::<f64>();
    let start = (0..SAMPLES).max_by(|a, b| clearness(*a).total_cmp(&clearness(*b)))?;
    let means = sectors(start);
    if !means.iter().all(|mean| mean.abs() >= LEAST_CLEARNESS) {
        return None;
    }
    let word = (0..bits).filter(|sector| means[*sector] > 0.0).map(|sector| 1_u32 << sector).sum();
    let (word, first) = smallest_turn(word, bits);
    let start_rad = std::f64::consts::TAU * (start + first * SAMPLES) as f64 / count as f64;
    Some(Reading { word, start_rad })
}

/// Share of the contrast that the blur leaves at a radius within the ring, of a circle as large as the ellipse.
fn left_by_blur(disc: &CircleSighting, parts: f64) -> f64 {
    let blur = whole_blur(disc) / disc.ellipse.mean_radius_px();
    let share = |edge: f64| 0.5 * (1.0 + NormalTable::new().profile((parts - edge) / blur).0);
    share(RING[0]) - share(RING[1])
}

/// Deviation of the blur with that of a pixel, pixel.
pub(super) fn whole_blur(disc: &CircleSighting) -> f64 {
    (disc.blur_px * disc.blur_px + 1.0 / 12.0).sqrt()
}
