//! Alignment of pairs of which nothing is known.

use nalgebra::Isometry3;

use crate::cloud::Cloud;
use crate::error::Result;

/// A pose `target_from_source` for each pair (target, source).
pub(super) fn poses(_stations: &[Cloud], pairs: &[(usize, usize)]) -> Vec<Result<Isometry3<f64>>> {
    pairs.iter().map(|_| Ok(Isometry3::identity())).collect()
}
