//! Weight from the similarity of intensities.

use rigid_pose::require_positive;
use statistics::mad_scale;

use super::PairWeighting;
use crate::parts::scene::{Pair, Scene};

/// `exp(−(ΔI / (k s))² / 2)`: the difference of the intensities of a pair over its robust scale s among all pairs, the
/// compatibility of colours in `[RusinkiewiczLevoy2001]` without its threshold. Pairs of which an intensity is unknown
/// keep their weight; no effect where a cloud has none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntensityWeight {
    /// The factor k. Default 2.
    pub width: f64,
}

impl Default for IntensityWeight {
    fn default() -> Self {
        Self { width: 2.0 }
    }
}

impl PairWeighting for IntensityWeight {
    fn weigh(&self, scene: &Scene<'_>, pairs: &mut [Pair]) {
        let target = scene.target.cloud.and_then(|cloud| cloud.intensity.as_ref());
        let (Some(source), Some(target)) = (&scene.source.intensity, target) else { return };
        let difference = |pair: &Pair| pair.target.map_or(f64::NAN, |i| source[pair.source] - target[i]);
        let mut known: Vec<f64> = pairs.iter().map(|p| difference(p).abs()).filter(|d| d.is_finite()).collect();
        let scale = self.width * mad_scale(&mut known);
        // Equal intensities throughout tell nothing.
        if scale.is_nan() || scale <= 0.0 {
            return;
        }
        for pair in pairs {
            let u = difference(pair) / scale;
            if u.is_finite() {
                pair.weight *= (-0.5 * u * u).exp();
            }
        }
    }

    fn validate(&self) -> crate::error::Result<()> {
        Ok(require_positive("width", self.width)?)
    }
}
