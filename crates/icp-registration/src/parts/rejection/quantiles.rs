//! Pairs that are too far apart compared with the others.

use statistics::ranked;

use super::PairRejection;
use crate::error::{Error, Result};
use crate::parts::require_positive;
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
        if self.0 > 0.0 && self.0 <= 1.0 {
            return Ok(());
        }
        Err(Error::InvalidOption { name: "trim", value: self.0, domain: "above 0 and at most 1" })
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
        require_positive("median_multiple", self.0)
    }
}

/// Keeps the pairs within a multiple of a quantile of the distances.
fn keep_within(pairs: &mut Vec<Pair>, fraction: f64, multiple: f64) {
    let mut distances: Vec<f64> = pairs.iter().map(|p| p.distance_m).collect();
    let limit = multiple * ranked(&mut distances, fraction);
    pairs.retain(|p| p.distance_m <= limit);
}
