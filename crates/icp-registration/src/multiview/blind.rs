//! Alignment of pairs of which nothing is known.

use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::cloud::Cloud;
use crate::coarse::{CoarseOptions, FeatureCloud, align_without_guess};
use crate::error::Result;

/// A pose `target_from_source` for each pair (target, source), or why there is none.
pub(super) fn poses(stations: &[Cloud], pairs: &[(usize, usize)]) -> Vec<Result<Isometry3<f64>>> {
    let options = CoarseOptions::default();
    let features: Vec<Result<FeatureCloud>> =
        stations.par_iter().map(|cloud| FeatureCloud::new(cloud, &options)).collect();
    let align = |&(target, source): &(usize, usize)| {
        let (target, source) = (features[target].as_ref(), features[source].as_ref());
        let (target, source) = (target.map_err(Clone::clone)?, source.map_err(Clone::clone)?);
        Ok(align_without_guess(source, target, &options)?.target_from_source)
    };
    pairs.par_iter().map(align).collect()
}
