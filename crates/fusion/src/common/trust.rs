//! How far places beside each other tell the same.
//!
//! The equations take places as independent. What no source states (a camera whose error bends from frame to frame, by depth, by slant) is
//! alike at neighbours, and shows in the residuals: their sums over blocks of places vary by more than those of independent ones.

use nalgebra::DVector;

use super::equations::{Ties, fits, residuals};

/// Part that is believed until it is known. Poses that follow what is alike hide it: with all of it, two of 56 frames of a Kinect are set
/// apart by it, and far walls are half as thick again.
pub(super) const AT_FIRST: f64 = 0.4;
/// Width of blocks, cells. Of two, half of it is missed; of eight, poses follow what is alike, and it shows less.
const BLOCK: f64 = 4.0;
/// Variance of the sums over that of independent places as stated, where all is stated: the neighbourhoods that places share are
/// counted as often as they may be. Simulated rooms have 0.35 to 0.82; frames of a Kinect 1.5 to 1.9.
const EXPECTED: f64 = 0.65;

/// Part of what places tell of common errors that is to be believed, at most all of it, given the residuals with common errors of these values.
pub(super) fn trust(ties: &Ties, values: &DVector<f64>, voxel_m: f64) -> f64 {
    let mut parts: Vec<([i64; 4], f64, f64)> = Vec::new();
    for (place, rows) in ties {
        let Some(sums) = residuals(place, rows, values).filter(|sums| fits(place, sums)) else { continue };
        let block = place.position.coords.map(|at| (at / (BLOCK * voxel_m)).floor() as i64);
        let weight: f64 = place.frames.iter().map(|frame| frame.normal[(0, 0)]).sum();
        for (frame, sum) in place.frames.iter().zip(sums) {
            let own = frame.normal[(0, 0)];
            parts.push(([i64::from(frame.frame), block.x, block.y, block.z], sum, own * (1.0 - own / weight)));
        }
    }
    parts.sort_by_key(|(block, ..)| *block);
    let of_block = |block: &[([i64; 4], f64, f64)]| {
        let (sum, expected) = block.iter().fold((0.0, 0.0), |(sum, all), (_, own, by)| (sum + own, all + by));
        (sum * sum, expected)
    };
    let mut blocks: Vec<(f64, f64)> = parts.chunk_by(|a, b| a.0 == b.0).map(of_block).collect();
    // The order of blocks is that of the numbers of frames, which the caller chose; the sum does not know it.
    blocks.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let (found, expected) =
        blocks.into_iter().fold((0.0, 0.0), |all: (f64, f64), next| (all.0 + next.0, all.1 + next.1));
    if found > EXPECTED * expected { EXPECTED * expected / found } else { 1.0 }
}
