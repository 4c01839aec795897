//! Judging a cloud among many: what speaks for its pose, and its refinement against all that have been placed.

use nalgebra::{Isometry3, Translation3};

use crate::description::feature_cloud::FeatureCloud;
use crate::description::view::Jumps;
use crate::error::Result;
use crate::options::CoarseOptions;
use crate::verification::judge::Verdict;
use crate::verification::refine;

/// The clouds in voxels of one size, that of the coarsest.
pub fn with_one_voxel(clouds: Vec<FeatureCloud>, options: &CoarseOptions) -> Result<Vec<FeatureCloud>> {
    let voxel_m = clouds.iter().map(FeatureCloud::voxel_m).fold(0.0, f64::max);
    clouds.into_iter().map(|cloud| in_voxels(cloud, voxel_m, options)).collect()
}

/// A cloud in voxels of this size, or as it is where its own are no smaller.
pub fn in_voxels(cloud: FeatureCloud, voxel_m: f64, options: &CoarseOptions) -> Result<FeatureCloud> {
    if cloud.voxel_m() < 0.999 * voxel_m { cloud.coarsened(voxel_m, options) } else { Ok(cloud) }
}

/// A cloud and its pose `world_from_cloud`.
pub type Placed<'a> = (&'a FeatureCloud, Isometry3<f64>);

fn from_middle(placed: &Placed<'_>) -> Isometry3<f64> {
    placed.1 * Translation3::from(placed.0.reduced.middle)
}

fn verdict(a: &Placed<'_>, b: &Placed<'_>, stride: usize, jumps: Jumps) -> Verdict {
    Verdict::with(b.0, a.0, &(from_middle(a).inverse() * from_middle(b)), stride, jumps)
}

/// What speaks for two clouds lying like this, in sampled points: those with a partner less those that contradict.
/// Every `stride`-th sampled point is looked at. Clouds that see nothing in common have none.
pub fn evidence(a: &Placed<'_>, b: &Placed<'_>, stride: usize) -> f64 {
    verdict(a, b, stride, Jumps::Missed).evidence() * stride as f64
}

/// How the sampled points of two clouds lie for each other: those on the other's surface, and those that contradict it, in
/// space that it looked through or beside a surface that they should lie on.
pub fn agreement(a: &Placed<'_>, b: &Placed<'_>) -> (usize, usize) {
    counted(a, b, Jumps::Missed)
}

/// The same where clouds may lie in different rooms: the side of a thin wall that faces away from a viewpoint says nothing about what
/// was seen of the other side.
pub fn agreement_of_rooms(a: &Placed<'_>, b: &Placed<'_>) -> (usize, usize) {
    counted(a, b, Jumps::MissedByFronts)
}

fn counted(a: &Placed<'_>, b: &Placed<'_>, jumps: Jumps) -> (usize, usize) {
    let verdict = verdict(a, b, 1, jumps);
    (verdict.hits, verdict.in_free + verdict.missed)
}

/// Brings a cloud that is nearly in place onto all those around it, point to plane.
pub fn refined_among(source: &Placed<'_>, around: &[Placed<'_>], steps: usize) -> Isometry3<f64> {
    let targets: Vec<(&FeatureCloud, Isometry3<f64>)> = around.iter().map(|t| (t.0, from_middle(t))).collect();
    let pose = refine::refine_among(source.0, &targets, &from_middle(source), steps);
    pose * Translation3::from(-source.0.reduced.middle)
}
