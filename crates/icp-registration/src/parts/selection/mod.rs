//! Which source points take part.

mod normal_space;
mod stability;

use normal_space::normal_space;
use rigid_pose::require_count;
use stability::stability;

use super::scene::Scene;
use crate::error::Result;

/// Chooses source points.
pub trait PointSelection: Sync {
    /// Indices of source points, each at most once, in the order in which they are worked on.
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>>;
}

/// Which source points take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Selection {
    /// All `[BeslMcKay1992]`.
    #[default]
    All,
    /// Every n-th in the order of the cloud `[TurkLevoy1994]`.
    EveryNth(usize),
    /// About this many, spread evenly over the directions of the normals `[RusinkiewiczLevoy2001]`: what few points
    /// say about a sliding direction is not drowned by a large wall. Points without a normal are left out.
    NormalSpace(usize),
    /// About this many, chosen such that all six motions are held as evenly as the surface allows `[Gelfand2003]`: the next
    /// point is always one that holds the motion held least so far. Points without a normal are left out.
    Stability(usize),
}

impl PointSelection for Selection {
    fn select(&self, scene: &Scene<'_>) -> Result<Vec<usize>> {
        if let Self::EveryNth(number) | Self::NormalSpace(number) | Self::Stability(number) = *self {
            require_count("selection", number, 1)?;
        }
        match *self {
            Self::All => Ok((0..scene.source.len()).collect()),
            Self::EveryNth(n) => Ok((0..scene.source.len()).step_by(n).collect()),
            Self::NormalSpace(count) => Ok(normal_space(scene.source_normals, count)),
            Self::Stability(count) => stability(scene, count),
        }
    }
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
