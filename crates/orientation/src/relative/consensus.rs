//! A station from points of which many may be wrong.

use camera_model::Camera;
use nalgebra::Isometry3;

use crate::relative::candidates::samples;
use crate::three_points::poses_from_three_points;
use crate::{ResectionOptions, TargetObservation, resect};

/// Points of a sample.
const SAMPLE: usize = 3;
/// Standard deviations of an image point within which a point fits: points and poses are approximate, gross errors larger.
pub(crate) const FITS: f64 = 10.0;

/// The pose on which most targets agree, from samples of three `[FischlerBolles1981]`, adjusted to those that fit. `None` where
/// not even one more than the sample does.
pub(crate) fn consensus_resection(camera: &Camera, targets: &[TargetObservation], seed: u64) -> Option<Isometry3<f64>> {
    let poses = samples::<SAMPLE>(targets.len(), seed).into_iter().flat_map(|sample| {
        poses_from_three_points(&sample.map(|i| targets[i].point), &sample.map(|i| camera.ray(targets[i].pixel)))
    });
    let scored = poses.map(|pose| (targets.iter().map(|target| misfit(camera, target, &pose)).sum::<f64>(), pose));
    let (_, pose) = scored.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let agreeing: Vec<_> = targets.iter().filter(|target| misfit(camera, target, &pose) < 1.0).copied().collect();
    if agreeing.len() <= SAMPLE {
        return None;
    }
    let options = ResectionOptions { approximate: Some(pose), ..ResectionOptions::default() };
    resect(camera, &agreeing, &options).ok().map(|station| station.world_from_camera)
}

/// Square of a distance in the image over that within which a target fits; 1 where it does not.
fn misfit(camera: &Camera, target: &TargetObservation, world_from_camera: &Isometry3<f64>) -> f64 {
    let Ok([col, row]) = camera.project(&world_from_camera.inverse_transform_point(&target.point)) else { return 1.0 };
    let across = (col - target.pixel[0]) / target.sigma_pixel[0];
    let down = (row - target.pixel[1]) / target.sigma_pixel[1];
    ((across * across + down * down) / (FITS * FITS)).min(1.0)
}
