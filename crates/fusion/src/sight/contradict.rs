//! Surfels that hide what a frame has seen.

use rayon::prelude::*;
use statistics::{Distribution, bonferroni};

use super::Scene;
use crate::FusionOptions;
use crate::outcome::Contradiction;

/// Distances below this part of a cell are its shape, whatever the deviations say.
const SHAPE: f64 = 0.1;
/// Fewest points of surfels that contradict: of less it is the points that do.
const FEWEST: u32 = 4;
/// Part of a surfel's radius within which a ray certainly meets it: beyond is the rim, which edges are rounded by.
const SOLID: f64 = 0.8;

/// Pairs of surfels of which one was seen through the other, tested at one level for all.
pub(crate) fn contradictions(scene: &Scene<'_>, options: &FusionOptions) -> Vec<Contradiction> {
    let limit = Distribution::Normal.critical(bonferroni(options.level, scene.surfels.len()));
    let least_m = SHAPE * options.voxel_m;
    (0..scene.surfels.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|behind| {
            let frames = scene.surfels[behind].frames.iter();
            frames.filter_map(|frame| seen_through(scene, behind, *frame, limit, least_m)).collect::<Vec<_>>()
        })
        .collect::<Vec<_>>()
        .into_iter()
        .flatten()
        .collect()
}

fn seen_through(scene: &Scene<'_>, behind: usize, frame: u32, limit: f64, least_m: f64) -> Option<Contradiction> {
    let far = &scene.surfels[behind];
    let front = scene.toward(frame, &far.position)?;
    if front as usize == behind || scene.has_seen(frame, front) {
        return None;
    }
    let near = &scene.surfels[front as usize];
    if near.points.min(far.points) < FEWEST {
        return None;
    }
    let distance_m = -near.normal.dot(&(far.position - near.position));
    let sigma_m = near.sigma_m().hypot(far.sigma_m());
    let sight = far.position - scene.centres[frame as usize];
    let foot = far.position + sight * (distance_m / near.normal.dot(&sight));
    let is_solid = (foot - near.position).norm() <= SOLID * near.radius_m;
    (is_solid && distance_m > limit * sigma_m && distance_m > least_m).then(|| Contradiction {
        front,
        front_frame: near.frames.first().copied().unwrap_or_default(),
        behind: behind as u32,
        seen_through_by: frame,
        distance_m,
        deviations: distance_m / sigma_m,
    })
}
