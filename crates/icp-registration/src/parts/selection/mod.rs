//! Which source points take part.

mod normal_space;
mod stability;

pub use normal_space::NormalSpace;
pub use stability::Stability;

use rigid_pose::require_count;

use super::scene::Scene;
use crate::error::Result;

/// Chooses source points.
pub trait PointSelection: Sync {
    /// Indices of source points, each at most once, in the order in which they are worked on.
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>>;
}

/// All points `[BeslMcKay1992]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AllPoints;

impl PointSelection for AllPoints {
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>> {
        Ok((0..scene.source.len()).collect())
    }
}

/// Every n-th point in the order of the cloud `[TurkLevoy1994]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EveryNth(pub usize);

impl PointSelection for EveryNth {
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>> {
        require_count("selection", self.0, 1)?;
        Ok((0..scene.source.len()).step_by(self.0).collect())
    }
}

/// A random sample without repetition `[Masuda1996]`, the same for the same seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RandomPoints {
    /// Number of points; all where the cloud has fewer.
    pub count: usize,
    /// Seed of the generator.
    pub seed: u64,
}

impl PointSelection for RandomPoints {
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>> {
        require_count("count", self.count, 1)?;
        let mut drawn: Vec<(u64, usize)> =
            (0..scene.source.len()).map(|i| (scrambled(self.seed, i as u64), i)).collect();
        drawn.sort_unstable();
        let mut chosen: Vec<usize> = drawn.into_iter().take(self.count).map(|(_, i)| i).collect();
        chosen.sort_unstable();
        Ok(chosen)
    }
}

/// A number without pattern for each index (the finaliser of `SplitMix64` `[Steele2014]`).
fn scrambled(seed: u64, index: u64) -> u64 {
    let mut z = seed.wrapping_add((index.wrapping_add(1)).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Every k-th of the selected such that about `wanted` remain.
pub(crate) fn thinned(selected: &[usize], wanted: usize) -> Vec<usize> {
    selected.iter().copied().step_by(selected.len().div_ceil(wanted.max(1)).max(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::thinned;

    #[test]
    fn thinning_keeps_about_the_wanted_number() {
        let all: Vec<usize> = (0..1000).collect();
        assert_eq!(thinned(&all, 300).len(), 250);
        assert_eq!(thinned(&all, 5000).len(), 1000);
        assert!(thinned(&[], 10).is_empty());
    }
}
