//! Approximate poses in closed form, the best first.

use camera_model::Camera;
use nalgebra::{Isometry3, Point3};
use rigid_pose::absolute_orientation;

use crate::resection::Start;
use crate::target::{TargetObservation, spread_ratio};
use crate::three_points::poses_from_three_points;

/// Up to this many targets every triple is tried (35 of seven); of more, as many triples spread over the list.
const ALL_TRIPLES_UP_TO: usize = 7;
const TRIPLES: usize = 35;

/// Triples flatter than this give directions across them from noise alone.
const FLAT_TRIPLE: f64 = 0.02;

/// Approximations nearer to each other than this belong to one minimum.
const SAME_ANGLE_RAD: f64 = 0.2;

/// Distinct approximations that are worth an adjustment: four solutions of three points, and some to spare.
const MOST: usize = 6;

/// An approximation is hopeless when its mean absolute residual, in standard deviations, is larger by this factor than
/// that of the best, or than 1 where the best is better: what a rival would still lose by adjustment is a few.
const HOPELESS: f64 = 10.0;

/// A pose to begin with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Approximation {
    pub(crate) world_from_camera: Isometry3<f64>,
    pub(crate) start: Start,
    cost: f64,
}

/// Distinct approximate poses `world_from_camera` in closed form, the one that fits best first: from three ranges or more,
/// and from triples of image points. Empty where no triple has a solution that all targets can be seen from.
///
/// They are as good as their three points, and gross errors may have part in all of them: to be looked at, not to be
/// believed. See [`resect`](crate::resect).
pub fn approximate_poses(camera: &Camera, targets: &[TargetObservation]) -> Vec<Isometry3<f64>> {
    approximations(camera, targets).into_iter().map(|found| found.world_from_camera).collect()
}

/// Distinct approximate poses, the one that fits best first.
pub(crate) fn approximations(camera: &Camera, targets: &[TargetObservation]) -> Vec<Approximation> {
    let from_ranges = from_ranges(camera, targets).map(|pose| (pose, Start::Ranges));
    let from_triples = triples(targets.len()).into_iter().flat_map(|triple| from_triple(camera, targets, triple));
    let poses = from_ranges.into_iter().chain(from_triples.map(|pose| (pose, Start::ImagePoints)));
    let values = targets.iter().map(|target| if target.range.is_some() { 3.0 } else { 2.0 }).sum::<f64>();
    let mut worst = f64::INFINITY;
    let mut found = Vec::new();
    for (world_from_camera, start) in poses {
        if let Some(cost) = cost(camera, targets, &world_from_camera, worst) {
            worst = worst.min(HOPELESS * cost.max(values));
            found.push(Approximation { world_from_camera, start, cost });
        }
    }
    found.retain(|candidate| candidate.cost <= worst);
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    distinct(found)
}

/// The best of each group of approximations that lead to one minimum.
fn distinct(sorted: Vec<Approximation>) -> Vec<Approximation> {
    let mut distinct: Vec<Approximation> = Vec::new();
    for candidate in sorted {
        let is_new = distinct.iter().all(|other| {
            candidate.world_from_camera.rotation.angle_to(&other.world_from_camera.rotation) > SAME_ANGLE_RAD
        });
        if is_new && distinct.len() < MOST {
            distinct.push(candidate);
        }
    }
    distinct
}

/// Three or more ranges make points of their own in the camera frame.
fn from_ranges(camera: &Camera, targets: &[TargetObservation]) -> Option<Isometry3<f64>> {
    let (in_camera, in_world): (Vec<_>, Vec<_>) = targets
        .iter()
        .filter_map(|target| Some((camera.point(target.pixel, target.range?.range_m), target.point)))
        .unzip();
    absolute_orientation(&in_camera, &in_world, None).ok().map(|orientation| orientation.target_from_source)
}

fn from_triple(camera: &Camera, targets: &[TargetObservation], triple: [usize; 3]) -> Vec<Isometry3<f64>> {
    let points: [Point3<f64>; 3] = triple.map(|i| targets[i].point);
    if spread_ratio(&points) < FLAT_TRIPLE {
        return Vec::new();
    }
    poses_from_three_points(&points, &triple.map(|i| camera.ray(targets[i].pixel)))
}

/// Triples of `count` targets: all, or a fixed choice spread over the list.
fn triples(count: usize) -> Vec<[usize; 3]> {
    if count <= ALL_TRIPLES_UP_TO {
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        return pairs.flat_map(|(i, j)| (j + 1..count).map(move |k| [i, j, k])).collect();
    }
    // Offsets of a third and two thirds of the list, varied by different steps, never meet for more than seven.
    let spread = |i: usize| [i, i + count / 3 + i % 2, i + 2 * count / 3 + i % 3].map(|index| index % count);
    let distinct = |t: &[usize; 3]| t[0] != t[1] && t[1] != t[2] && t[0] != t[2];
    (0..TRIPLES).map(|i| spread(i * count / TRIPLES + i)).filter(distinct).collect()
}

/// Sum of absolute residuals over their standard deviations; a few gross errors do not decide it. `None` where a
/// target would not be seen, or the sum exceeds `worst`.
fn cost(camera: &Camera, targets: &[TargetObservation], world_from_camera: &Isometry3<f64>, worst: f64) -> Option<f64> {
    let mut sum = 0.0;
    for target in targets {
        let seen = camera.observe(world_from_camera, &target.point).ok()?;
        let pixel = camera.format.pixel_from_image(seen.image_mm);
        sum += ((pixel[0] - target.pixel[0]) / target.sigma_pixel[0]).abs();
        sum += ((pixel[1] - target.pixel[1]) / target.sigma_pixel[1]).abs();
        sum += target.range.map_or(0.0, |range| ((seen.range_m - range.range_m) / range.sigma_m).abs());
        if sum.is_nan() || sum > worst {
            return None;
        }
    }
    Some(sum)
}
