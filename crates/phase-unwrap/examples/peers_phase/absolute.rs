//! Absolute counts of one frequency, in rooms of several seeds.

use std::f32::consts::TAU;

use phase_unwrap::{KnownWraps, SpatialOptions, Unwrapped, Unwrapper};
use range_image::Raster;

use crate::measure::measured;
use crate::room::{Patches, Room, View};
use crate::{Outcome, Size};

/// Prints `name right sure_and_right unknown wrong milliseconds`: shares of right counts, sure or not, of those that are
/// sure as well, and of unknown ones among all pixels, of wrong ones among the sure, the least time of three.
pub fn run(patches: Patches, size: Size, seed: u64) -> Outcome {
    let room = Room::new(seed, patches, size);
    let view = room.view(1000 + seed);
    let plain = SpatialOptions::default();
    for (name, options) in [
        ("amplitude_1", SpatialOptions { maximum_wraps: 1, ..plain }),
        ("amplitude_2", plain),
        ("geometry_2", SpatialOptions { geometry: Some(room.geometry()), ..plain }),
    ] {
        let mut unwrapper = Unwrapper::new(options)?;
        let mut least = f64::INFINITY;
        let mut found = Unwrapped::default();
        for _ in 0..3 {
            let (answer, milliseconds, _) =
                measured(|| unwrapper.unwrap(&view.phase, Some(&view.amplitude), None, KnownWraps::Nothing));
            (found, least) = (answer?, least.min(milliseconds));
        }
        let [right, sure, unknown, wrong] = shares(&found.wraps, &found.unsure(options.minimum_confidence), &view);
        println!("{name} {right} {sure} {unknown} {wrong} {least}");
    }
    Ok(())
}

/// Right among all, right and sure among all, unknown among all, wrong among the sure. Right is the count that brings the phase next to the truth.
fn shares(wraps: &Raster<i32>, unsure: &Raster<bool>, view: &View) -> [f64; 4] {
    let (mut right, mut sure, mut unknown, mut wrong) = (0.0, 0.0, 0.0, 0.0);
    for (index, &found) in wraps.as_slice().iter().enumerate() {
        let truth = ((view.truth.as_slice()[index] - view.phase.as_slice()[index]) / TAU).round() as i32;
        right += f64::from(found == truth);
        if unsure.as_slice()[index] {
            unknown += 1.0;
        } else if found == truth {
            sure += 1.0;
        } else {
            wrong += 1.0;
        }
    }
    let all = wraps.len() as f64;
    [right / all, sure / all, unknown / all, wrong / f64::max(sure + wrong, 1.0)]
}
