//! The size of patches: wide enough to hold points, and wide enough to be seen as planes through the noise.

use nalgebra::Vector3;

use crate::surfaces::grouping::{group, patch_size};
use crate::surfaces::patches::FEWEST_POINTS;
use crate::surfaces::plane_fit::Moments;
use point_cloud::Cloud;
use point_cloud::eigenvalues3;

/// Least width of a patch in standard deviations of its points across it: a square of that width scatters along its plane
/// by 4 times as much as across it, which is what counts as a plane. Walls of cameras with a noise of 0.3 % of the range
/// have twice that at 25 points; from 10 to 14 nothing changes there.
const NOISE: f64 = 14.0;
/// Part of the points that must lie in patches that wide for their noise.
const ENOUGH: f64 = 0.9;
/// Factor between sizes that are tried.
const STEP: f64 = std::f64::consts::SQRT_2;

/// Size of the patches of a cloud, metre: about 25 points each, and more where noise asks for it.
///
/// Points of a patch much narrower than their noise form no plane, or a plane of any direction; those whose errors
/// neighbours share (rounded depths, filters) form a plane of their own, which twice the size shows. Where a larger size
/// finds more scatter than it gains in width, surfaces end or bend: then the size before stays.
pub(crate) fn size(cloud: &Cloud, normals: &[Vector3<f64>]) -> f64 {
    let first_m = patch_size(cloud);
    let (mut best_m, mut best_ratio) = (first_m, 0.0);
    let mut size_m = first_m;
    loop {
        let ratio = size_m / scatter(cloud, normals, 2.0 * size_m);
        // No scatter, and none that could be told, is no reason for another size.
        if ratio.is_nan() || ratio >= NOISE {
            return size_m;
        }
        if ratio < best_ratio {
            return best_m;
        }
        (best_m, best_ratio) = (size_m, ratio);
        size_m *= STEP;
    }
}

/// Standard deviation across patches of a size that nearly all points do not exceed, metre.
fn scatter(cloud: &Cloud, normals: &[Vector3<f64>], size_m: f64) -> f64 {
    let mut found: Vec<(f64, usize)> = Vec::new();
    for points in group(cloud, normals, size_m).iter().filter(|points| points.len() >= FEWEST_POINTS) {
        let origin = cloud.points[points[0] as usize].coords;
        let moments = Moments::of(&cloud.points, points, &origin);
        let count = moments.count();
        let variance = eigenvalues3(&moments.scatter())[0].max(0.0) * count / (count - 3.0);
        found.push((variance.sqrt(), points.len()));
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: usize = found.iter().map(|(_, points)| points).sum();
    let mut before = 0;
    let at = found.iter().find(|(_, points)| {
        before += points;
        before as f64 >= ENOUGH * all as f64
    });
    at.map_or(0.0, |(sigma, _)| *sigma)
}
