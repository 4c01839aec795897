//! Random samples of three correspondences that agree with each other `[FischlerBolles1981]`.

use crate::hypotheses::correspondences::{Correspondences, Tolerance};

/// Small generator of random numbers (splitmix64): its sequence is part of the result and must not change with a
/// library.
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((u128::from(z) * count as u128) >> 64) as usize
    }
}

/// The samples (of `samples` drawn) whose three members agree, with all that agree with their pose; at most `count`,
/// those with the most inliers.
pub(crate) fn consistent_samples(
    correspondences: &Correspondences,
    tolerance: Tolerance,
    arm: f32,
    samples: usize,
    count: usize,
    seed: u64,
) -> Vec<Vec<u32>> {
    let total = correspondences.len();
    if total < 3 {
        return Vec::new();
    }
    let mut random = Random(seed);
    let mut found: Vec<Vec<u32>> = Vec::new();
    for _ in 0..samples {
        let [a, b, c] = [random.below(total), random.below(total), random.below(total)];
        let agree = |i, j| correspondences.agree(i, j, tolerance);
        if !(agree(a, b) && agree(a, c) && agree(b, c)) {
            continue;
        }
        let Some(pose) = correspondences.solve(&[a as u32, b as u32, c as u32], arm) else { continue };
        let inliers = correspondences.inliers(&pose, tolerance);
        if inliers.len() >= 3 {
            found.push(inliers);
        }
        // Kept short on the way; sorting is stable, so that earlier samples win ties.
        if found.len() == 4 * count {
            found.sort_by_key(|inliers| std::cmp::Reverse(inliers.len()));
            found.truncate(count);
        }
    }
    found.sort_by_key(|inliers| std::cmp::Reverse(inliers.len()));
    found.truncate(count);
    found
}
