//! Pairs of source and target points at a given pose.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;

use super::{IcpOptions, IcpTarget, Metric};
use crate::cloud::Cloud;
use crate::error::{Error, Result};
use crate::kernel::quantile;
use crate::neighbours::is_usable;

/// Points handled together by one thread; fixed, so that sums do not depend on the number of threads.
pub(crate) const CHUNK: usize = 1024;

/// A source point and its partner.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pair {
    pub source: usize,
    pub target: usize,
    /// The source point in the target frame.
    pub moved: Vector3<f64>,
    pub distance_m: f64,
}

/// What the matching needs besides the pose.
pub(crate) struct Matcher<'a> {
    pub source: &'a Cloud,
    pub source_normals: Option<&'a [Vector3<f64>]>,
    pub target: &'a IcpTarget,
    pub options: IcpOptions,
}

impl Matcher<'_> {
    /// Pairs of the selected points in their order: the nearest target point, refused beyond `limit_m`, where the
    /// metric needs a normal that is not there, and where the normals disagree.
    pub(crate) fn pairs(&self, pose: &Isometry3<f64>, selected: &[usize], limit_m: f64) -> Result<Vec<Pair>> {
        let chunks: Result<Vec<Vec<Pair>>> = selected
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().filter_map(|&i| self.pair(pose, i, limit_m).transpose()).collect())
            .collect();
        Ok(chunks?.concat())
    }

    /// Pairs after trimming, or the error that there are too few.
    pub(crate) fn enough_pairs(
        &self,
        pose: &Isometry3<f64>,
        selected: &[usize],
        limit_m: f64,
        iteration: usize,
    ) -> Result<Vec<Pair>> {
        let pairs = self.trimmed(self.pairs(pose, selected, limit_m)?);
        let (found, of, needed) = (pairs.len(), selected.len(), self.options.min_correspondences);
        if found < needed {
            return Err(Error::TooFewCorrespondences { found, of, needed, max_distance_m: limit_m, iteration });
        }
        Ok(pairs)
    }

    /// The pairs that are left after trimming to the fraction `trim` with the smallest distances.
    pub(crate) fn trimmed(&self, mut pairs: Vec<Pair>) -> Vec<Pair> {
        if self.options.trim < 1.0 {
            let mut distances: Vec<f64> = pairs.iter().map(|p| p.distance_m).collect();
            let limit = quantile(&mut distances, self.options.trim);
            pairs.retain(|p| p.distance_m <= limit);
        }
        pairs
    }

    fn pair(&self, pose: &Isometry3<f64>, source: usize, limit_m: f64) -> Result<Option<Pair>> {
        let moved = pose * self.source.points[source];
        if !is_usable(&moved) {
            return Err(Error::NonFinite { what: "source points in the target frame", index: source });
        }
        let nearest = self.target.tree.any_nearest(&[moved.x, moved.y, moved.z]);
        let pair = Pair { source, target: nearest.index, moved: moved.coords, distance_m: nearest.distance_m };
        Ok((nearest.distance_m <= limit_m && self.normals_agree(pose, &pair)).then_some(pair))
    }

    fn normals_agree(&self, pose: &Isometry3<f64>, pair: &Pair) -> bool {
        let normal = &self.target.normals[pair.target];
        if self.options.metric == Metric::PointToPlane && normal.x.is_nan() {
            return false;
        }
        match (self.options.max_normal_angle_rad, self.source_normals) {
            // Where one of them has no normal there is nothing to compare.
            (Some(angle), Some(normals)) => {
                let cosine = (pose.rotation * normals[pair.source]).dot(normal).abs();
                cosine.is_nan() || cosine >= angle.cos()
            }
            _ => true,
        }
    }

    /// The same clouds with other options.
    pub(crate) fn with_options(&self, options: IcpOptions) -> Self {
        Self { source: self.source, source_normals: self.source_normals, target: self.target, options }
    }

    /// Median distance to the target of (a sample of) the source points at a pose, metre.
    pub(crate) fn median_distance(&self, pose: &Isometry3<f64>, sample: &[usize]) -> Result<f64> {
        let distances: Result<Vec<f64>> = sample
            .par_iter()
            .map(|&i| Ok(self.target.tree.nearest(&Point3::from(pose * self.source.points[i]))?.distance_m))
            .collect();
        Ok(quantile(&mut distances?, 0.5))
    }
}
