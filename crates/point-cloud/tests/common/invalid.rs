//! Pixels without a range, as dark or shining surfaces and interference leave them.
#![allow(dead_code)]

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// How pixels are lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    None,
    /// Each pixel on its own.
    Scattered,
    /// In clumps of two to four neighbours.
    Clumps,
}

pub const LOSSES: [Loss; 3] = [Loss::None, Loss::Scattered, Loss::Clumps];

/// Takes the given share of all pixels off a frame.
pub fn lose(points: &mut [[f64; 3]], width: usize, loss: Loss, share: f64, seed: u64) {
    let mut random = Pcg64::seed_from_u64(seed);
    let height = points.len() / width;
    let mut lost = vec![false; points.len()];
    let mut left = if loss == Loss::None { 0 } else { (share * points.len() as f64).round() as usize };
    while left > 0 {
        let size = if loss == Loss::Clumps { 2 + (random.random::<f64>() * 3.0) as usize } else { 1 };
        let [col, row] = [width - 1, height - 1].map(|most| (random.random::<f64>() * most as f64) as usize);
        // The first pixels of a square of 2 x 2, from any of its corners.
        let turn = (random.random::<f64>() * 4.0) as usize;
        for k in (0..size).map(|k| (k + turn) % 4) {
            let [right, down] = [[0, 0], [1, 0], [1, 1], [0, 1]][k];
            let place = (row + down) * width + col + right;
            if left > 0 && !lost[place] {
                lost[place] = true;
                left -= 1;
            }
        }
    }
    points.iter_mut().zip(lost).filter(|(_, lost)| *lost).for_each(|(point, _)| *point = [f64::NAN; 3]);
}
