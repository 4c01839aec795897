//! Poses and points from observations among which some are grossly wrong.

use adjust::SolveOptions;
use camera_model::Camera;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use rigid_pose::absolute_orientation;
use statistics::{mad_scale, upper_median};

use crate::target::NEEDED;
use crate::{Error, ResectionOptions, Result, TargetObservation, approximate_poses, resect};

/// Residuals beyond so many times the median's standard deviation are gross errors for a start value.
const OUTLYING: f64 = 4.0;
/// Share of the image's diagonal that a nominal lens misses most image points by at most: 4.5 pixels of 176 x 144.
const GOOD_SHARE: f64 = 0.02;
/// Approximate poses that miss the median image point by more times this share are of three points that do not belong to
/// each other: least squares would not find back from there.
const HOPELESS: f64 = 10.0;
/// Targets of a sample, and most samples of one kind.
const SAMPLE: usize = 4;
const MOST_SAMPLES: usize = 4;
/// Most iterations of a resection: that of contradictory targets creeps on without end. Chosen, not varied.
const MOST_ITERATIONS: usize = 20;
/// Rays that meet at less than this angle (radian, 1 degree) place a target too weakly to start from.
const SMALLEST_ANGLE: f64 = 0.0175;

/// Absolute orientation `target_from_source` that most pairs agree with: the triple with the least median residual, then
/// twice all pairs that fit it.
///
/// `pairs`: points of the source and of the target frame, metre, three or more; `None` where no triple of them spans a plane.
/// A start value: without a covariance.
pub fn robust_absolute_orientation(pairs: &[(Point3<f64>, Point3<f64>)]) -> Option<Isometry3<f64>> {
    let n = pairs.len();
    let fit = |chosen: &[usize]| {
        let source: Vec<_> = chosen.iter().map(|&i| pairs[i].0).collect();
        let target: Vec<_> = chosen.iter().map(|&i| pairs[i].1).collect();
        absolute_orientation(&source, &target, None).ok().map(|orientation| orientation.target_from_source)
    };
    let residuals = |pose: &Isometry3<f64>| pairs.iter().map(|(a, b)| (pose * a - b).norm()).collect::<Vec<f64>>();
    let strides = [(n / 3, 2 * n / 3), (n / 4, n / 2), (1, n / 2)];
    let triples = strides.iter().flat_map(|&(a, b)| (0..n).map(move |i| [i, (i + a) % n, (i + b) % n]));
    let distinct = triples.filter(|[a, b, c]| a != b && b != c && a != c);
    let scored = distinct.filter_map(|triple| fit(&triple)).map(|pose| (median(residuals(&pose)), pose));
    let (_, mut pose) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
    for _ in 0..2 {
        let distances = residuals(&pose);
        let limit = OUTLYING * mad_scale(&mut distances.clone());
        // Half of the pairs lie below the median in any case; without noise rounding decides.
        let inliers: Vec<usize> = (0..n).filter(|&i| distances[i] <= limit.max(1e-9)).collect();
        if inliers.len() >= NEEDED {
            pose = fit(&inliers).unwrap_or(pose);
        }
    }
    Some(pose)
}

/// Resection that leaves out the worst targets as long as they stand out from the others; where that fails, the one from
/// four targets that most of the others agree with, and then from these. The pose `world_from_camera` is a start value for an
/// adjustment that tests for gross errors.
///
/// # Errors
/// Those of [`resect`].
pub fn robust_resection(camera: &Camera, targets: &[TargetObservation]) -> Result<Isometry3<f64>> {
    let limit = GOOD_SHARE * (camera.format.width as f64).hypot(camera.format.height as f64);
    let typical = |pose: &Isometry3<f64>| median(distances(camera, targets, pose));
    let is_small = targets.len() <= SAMPLE + 1;
    let from_all = approximate_poses(camera, targets);
    let all = if is_small || from_all.iter().any(|pose| typical(pose) <= HOPELESS * limit) {
        trimmed_resection(camera, targets.to_vec(), None)
    } else {
        Err(Error::NoApproximation { targets: targets.len() })
    };
    if is_small || all.as_ref().is_ok_and(|pose| typical(pose) <= limit) {
        return all;
    }
    let n = targets.len();
    let samples = [(n / 4, n / 2, 3 * n / 4), (1, n / 3, n / 2), (n / 5, 2 * n / 5, 2 * n / 3)];
    let starts = || (0..n).step_by(n.div_ceil(MOST_SAMPLES));
    let samples =
        samples.into_iter().flat_map(|(a, b, c)| starts().map(move |i| [0, a, b, c].map(|step| (i + step) % n)));
    let distinct = samples.filter(|sample| (1..SAMPLE).all(|i| !sample[..i].contains(&sample[i])));
    let candidates = distinct.filter_map(|sample| {
        let chosen: Vec<TargetObservation> = sample.iter().map(|&index| targets[index]).collect();
        let found = approximate_poses(camera, &chosen).into_iter();
        found.map(|pose| (typical(&pose), pose)).min_by(|a, b| a.0.total_cmp(&b.0))
    });
    let given = all.as_ref().ok().map(|pose| (typical(pose), *pose));
    let Some((miss, pose)) = candidates.chain(given).min_by(|a, b| a.0.total_cmp(&b.0)) else { return all };
    if miss > HOPELESS * limit {
        return all;
    }
    let near = distances(camera, targets, &pose).into_iter().map(|distance| distance <= OUTLYING * miss);
    let agreeing = targets.iter().zip(near).filter(|(_, near)| *near).map(|(target, _)| *target).collect();
    Ok(trimmed_resection(camera, agreeing, None).unwrap_or(pose))
}

/// Distances of the image points from where a pose puts them, pixel.
fn distances(camera: &Camera, targets: &[TargetObservation], pose: &Isometry3<f64>) -> Vec<f64> {
    let distance = |target: &TargetObservation| {
        let Ok(seen) = camera.observe(pose, &target.point) else { return f64::INFINITY };
        let [col, row] = camera.format.pixel_from_image(seen.image_mm);
        (target.pixel[0] - col).hypot(target.pixel[1] - row)
    };
    targets.iter().map(distance).collect()
}

/// Resection that leaves out the worst targets as long as they stand out from the others; from an approximate pose, which
/// is much cheaper, or from none. At least two thirds of the targets stay.
///
/// # Errors
/// Those of [`resect`].
pub fn trimmed_resection(
    camera: &Camera,
    mut targets: Vec<TargetObservation>,
    approximate: Option<Isometry3<f64>>,
) -> Result<Isometry3<f64>> {
    let given = targets.len();
    let fewest = (given * 2).div_ceil(3).max(NEEDED + 1);
    let mut found = resect(camera, &targets, &from(approximate))?;
    loop {
        let sizes: Vec<f64> = found.residuals.iter().map(|r| r.pixel[0].hypot(r.pixel[1])).collect();
        let limit = 2.0 * OUTLYING * median(sizes.clone());
        let mut outlying: Vec<usize> = (0..sizes.len()).filter(|&i| sizes[i] > limit).collect();
        outlying.sort_by(|&a, &b| sizes[b].total_cmp(&sizes[a]));
        // The worst disturb the others: half of them go at a time, one by one in the end.
        outlying.truncate((outlying.len() / 2).max(1).min(targets.len().saturating_sub(fewest)));
        if outlying.is_empty() {
            // Without the targets that went, another of two poses may fit better.
            let is_open = approximate.is_none() && targets.len() < given;
            let anew = is_open.then(|| resect(camera, &targets, &from(None)).ok()).flatten();
            return Ok(anew.unwrap_or(found).world_from_camera);
        }
        let mut index = 0;
        targets.retain(|_| {
            index += 1;
            !outlying.contains(&(index - 1))
        });
        let start = Some(found.world_from_camera);
        found = resect(camera, &targets, &from(start))?;
    }
}

/// Options of a resection from an approximate pose, or from none.
fn from(approximate: Option<Isometry3<f64>>) -> ResectionOptions {
    let solve = SolveOptions { max_iterations: MOST_ITERATIONS, ..SolveOptions::default() };
    ResectionOptions { approximate, solve }
}

/// The point nearest to some rays (origin, unit direction); `None` where they meet at less than a degree.
pub fn intersect_rays(rays: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Point3<f64>> {
    let angle = |a: &Vector3<f64>, b: &Vector3<f64>| a.cross(b).norm();
    let widest = rays.iter().flat_map(|a| rays.iter().map(move |b| angle(&a.1, &b.1))).fold(0.0, f64::max);
    if widest < SMALLEST_ANGLE {
        return None;
    }
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (origin, direction) in rays {
        let across = Matrix3::identity() - direction * direction.transpose();
        normal += across;
        right += across * origin;
    }
    normal.try_inverse().map(|inverse| Point3::from(inverse * right))
}

fn median(mut values: Vec<f64>) -> f64 {
    upper_median(&mut values)
}
