//! How much a pair counts.

use statistics::upper_median;

use super::scene::{Pair, Scene};

/// Gives weights to pairs. Several multiply; a pair of weight zero is left out.
///
/// Weights are relative precisions: the robust kernel judges the residual times the root of the weight.
pub trait PairWeighting: Sync {
    /// Multiplies the weight of each pair.
    fn weigh(&self, scene: &Scene<'_>, pairs: &mut [Pair]);
}

/// `1 / (σ²_source + σ²_target)` from the sigmas of the clouds; where none is known for a pair, the median of the
/// others. No effect where neither cloud has sigmas.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SigmaWeight;

impl PairWeighting for SigmaWeight {
    fn weigh(&self, scene: &Scene<'_>, pairs: &mut [Pair]) {
        let of = |plane: Option<&Vec<f64>>, i: Option<usize>| match (plane, i) {
            (Some(sigma), Some(i)) => sigma[i].powi(2),
            _ => 0.0,
        };
        let target = scene.target.cloud.and_then(|cloud| cloud.sigma.as_ref());
        let source = scene.source.sigma.as_ref();
        if source.is_none() && target.is_none() {
            return;
        }
        let mut variances: Vec<f64> = pairs.iter().map(|p| of(source, Some(p.source)) + of(target, p.target)).collect();
        let mut known: Vec<f64> = variances.iter().copied().filter(|v| *v > 0.0).collect();
        let median = if known.is_empty() { 1.0 } else { upper_median(&mut known) };
        for (pair, variance) in pairs.iter_mut().zip(&mut variances) {
            // NaN fails the comparison.
            pair.weight /= if *variance > 0.0 { *variance } else { median };
        }
    }
}
