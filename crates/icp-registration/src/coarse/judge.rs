//! How well two clouds agree at a pose: partners on the surface, and points where the other camera looked through.

use nalgebra::Isometry3;

use super::correspondences::Motion;
use super::feature_cloud::FeatureCloud;
use super::fpfh::{dot, subtract};
use super::view::Sight;

/// Least cosine between the normals of partners.
const LEAST_COSINE: f32 = 0.8;
/// Largest distance of partners across the surface and in all, voxels.
const ACROSS_VOXELS: f32 = 0.8;
const IN_ALL_VOXELS: f32 = 2.0;
/// A point in free space counts this many times: points find partners on the wrong wall by chance, but hardly any lies
/// in front of what was seen where the pose is right.
const WEIGHT_OF_FREE: f64 = 2.0;

/// Counts over the sampled points of one or both clouds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Count {
    pub(super) points: usize,
    /// With a partner.
    pub(super) hits: usize,
    /// In front of what the other camera saw.
    pub(super) in_free: usize,
    /// Where the other camera saw a surface, but without a partner on it.
    pub(super) missed: usize,
}

/// The verdict on a pose.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Verdict {
    pub(super) source: Count,
    pub(super) target: Count,
}

impl Verdict {
    /// `pose`: target from source, both about their middles. Every `stride`-th sampled point is looked at.
    pub(super) fn new(source: &FeatureCloud, target: &FeatureCloud, pose: &Isometry3<f64>, stride: usize) -> Self {
        Self { source: count(source, target, pose, stride), target: count(target, source, &pose.inverse(), stride) }
    }

    /// Share of the points with a partner less those in free space, doubly counted, times the square of the agreement:
    /// at most 1, possibly negative. A wrong pose that slides walls along themselves has many partners, but misses more.
    pub(super) fn score(&self) -> f64 {
        let sum = |f: fn(&Count) -> usize| (f(&self.source) + f(&self.target)) as f64;
        let share = (sum(|c| c.hits) - WEIGHT_OF_FREE * sum(|c| c.in_free)) / sum(|c| c.points).max(1.0);
        share * self.agreement().powi(2)
    }

    /// Share of the points with a partner in the cloud that overlaps more.
    pub(super) fn overlap(&self) -> f64 {
        let share = |c: &Count| c.hits as f64 / c.points.max(1) as f64;
        share(&self.source).max(share(&self.target))
    }

    /// Share of hits among the points that the other camera should have seen.
    pub(super) fn agreement(&self) -> f64 {
        let sum = |f: fn(&Count) -> usize| (f(&self.source) + f(&self.target)) as f64;
        sum(|c| c.hits) / (sum(|c| c.hits) + sum(|c| c.in_free) + sum(|c| c.missed)).max(1.0)
    }
}

fn count(from: &FeatureCloud, to: &FeatureCloud, pose: &Isometry3<f64>, stride: usize) -> Count {
    let motion = Motion::new(pose);
    let sided = from.normals.sided && to.normals.sided;
    let voxel = to.reduced.voxel_m as f32;
    let mut count = Count::default();
    for &i in from.sample.iter().step_by(stride) {
        count.points += 1;
        let point = motion.point(from.reduced.points[i as usize]);
        let normal = motion.vector(from.normals.vectors[i as usize]);
        if has_partner(to, point, normal, sided, voxel) {
            count.hits += 1;
            continue;
        }
        match to.view.as_ref().map(|view| view.sight(point)) {
            Some(Sight::InFree) => count.in_free += 1,
            Some(Sight::OnSurface) => count.missed += 1,
            _ => {}
        }
    }
    count
}

fn has_partner(to: &FeatureCloud, point: [f32; 3], normal: [f32; 3], sided: bool, voxel: f32) -> bool {
    let Some(near) = to.labels[0].near(point) else { return false };
    let (own, d) = (to.normals.vectors[near], subtract(point, to.reduced.points[near]));
    let cosine = if sided { dot(normal, own) } else { dot(normal, own).abs() };
    let in_all = IN_ALL_VOXELS * voxel;
    cosine >= LEAST_COSINE && dot(d, own).abs() <= ACROSS_VOXELS * voxel && dot(d, d) <= in_all * in_all
}
