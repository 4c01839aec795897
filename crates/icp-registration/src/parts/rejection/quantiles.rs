//! Pairs that are too far apart compared with the others.

use rigid_pose::{require_option, require_positive};
use statistics::ranked;

use super::PairRejection;
use crate::error::Result;
use crate::parts::scene::{Pair, Scene};

/// Keeps this fraction of the pairs, those with the smallest distances `[Chetverikov2002]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trimmed(pub f64);

impl PairRejection for Trimmed {
    fn reject(&self, _: &Scene<'_>, pairs: &mut Vec<Pair>) {
        if self.0 < 1.0 {
            keep_within(pairs, self.0, 1.0);
        }
    }

    fn validate(&self, _: &Scene<'_>) -> Result<()> {
        Ok(require_option("trim", self.0, "above 0 and at most 1", |share| share > 0.0 && share <= 1.0)?)
    }
}

/// Refuses pairs farther apart than this multiple of the median distance `[Diebel2004]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MedianDistance(pub f64);

impl PairRejection for MedianDistance {
    fn reject(&self, _: &Scene<'_>, pairs: &mut Vec<Pair>) {
        keep_within(pairs, 0.5, self.0);
    }

    fn validate(&self, _: &Scene<'_>) -> Result<()> {
        Ok(require_positive("median_multiple", self.0)?)
    }
}

/// Keeps the pairs within a multiple of a quantile of the distances.
fn keep_within(pairs: &mut Vec<Pair>, fraction: f64, multiple: f64) {
    let mut distances: Vec<f64> = pairs.iter().map(|p| p.distance_m).collect();
    let limit = multiple * ranked(&mut distances, fraction);
    pairs.retain(|p| p.distance_m <= limit);
}
