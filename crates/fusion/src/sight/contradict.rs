//! Surfels that hide what a frame has seen.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;
use rayon::prelude::*;
use statistics::{Distribution, bonferroni};

use super::Scene;
use crate::FusionOptions;
use crate::outcome::{Contradiction, Surfel};
use crate::small::tangents;

/// Distances below this part of a cell are its shape, whatever the deviations say.
const SHAPE: f64 = 0.1;
/// Fewest points of surfels that contradict: of less it is the points that do.
const FEWEST: u32 = 4;
/// Part of a surfel's radius within which a ray certainly meets it: beyond is the rim, which edges are rounded by.
const SOLID: f64 = 0.8;
/// How many times as many frames decide which of two surfels is there: some sights are missed at rims, and of nearly equal numbers neither
/// side is right.
const MAJORITY: usize = 2;
/// Where a surfel is looked at, along both tangents in its radii: its middle, and four places well within it. Its middle alone is hidden by
/// the rims of others too often for a count of frames.
const PLACES: [[f64; 2]; 5] = [[0.0, 0.0], [0.5, 0.5], [-0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]];

/// Two surfels of a scene that cannot both be there.
pub(crate) struct Pair {
    pub front: u32,
    pub behind: u32,
    pub found: Contradiction,
}

/// Pairs of surfels of which one was seen through the other, tested at one level for all.
pub(crate) fn contradictions(scene: &Scene<'_>, options: &FusionOptions) -> Vec<Pair> {
    let limit = Distribution::Normal.critical(bonferroni(options.level, scene.surfels.len()));
    let least_m = SHAPE * options.voxel_m;
    (0..scene.surfels.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|behind| {
            let frames = scene.surfels[behind].frames.iter();
            frames.flat_map(|frame| seen_through(scene, behind, *frame, limit, least_m)).collect::<Vec<_>>()
        })
        .collect::<Vec<_>>()
        .into_iter()
        .flatten()
        .collect()
}

/// Which surfels stay, by all pairs that contradict.
///
/// A frame that looks through a surfel speaks against it: where twice as many do so as have seen it, it goes. Where twice as many have seen
/// it, it is what the others saw through it that cannot be there, and a surfel most of whose frames saw it so goes. Else both stay.
pub(crate) fn stay(surfels: &[Surfel], pairs: &[Pair]) -> Vec<bool> {
    let seen_by = |surfel: u32| surfels[surfel as usize].frames.len();
    let mut stays = vec![true; surfels.len()];
    let against = frames_by(pairs.iter(), |pair| pair.front);
    for (front, frames) in &against {
        stays[*front as usize] = frames.len() < MAJORITY * seen_by(*front);
    }
    let is_there = |front: u32| MAJORITY * against[&front].len() <= seen_by(front);
    for (behind, frames) in frames_by(pairs.iter().filter(|pair| is_there(pair.front)), |pair| pair.behind) {
        stays[behind as usize] &= 2 * frames.len() <= seen_by(behind);
    }
    stays
}

/// The frames of pairs, each once, by one of the surfels.
fn frames_by<'a>(pairs: impl Iterator<Item = &'a Pair>, surfel: fn(&Pair) -> u32) -> BTreeMap<u32, BTreeSet<u32>> {
    let mut frames: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
    for pair in pairs {
        frames.entry(surfel(pair)).or_default().insert(pair.found.seen_through_by);
    }
    frames
}

/// The surfels that a frame saw one through, each once.
fn seen_through(scene: &Scene<'_>, behind: usize, frame: u32, limit: f64, least_m: f64) -> Vec<Pair> {
    let far = &scene.surfels[behind];
    let [along, across] = tangents(&far.normal).map(|tangent| tangent * far.radius_m);
    let mut pairs: Vec<Pair> = Vec::new();
    for [s, t] in PLACES {
        let place = far.position + along * s + across * t;
        if let Some(pair) = through(scene, behind, &place, frame, limit, least_m)
            && pairs.iter().all(|known| known.front != pair.front)
        {
            pairs.push(pair);
        }
    }
    pairs
}

fn through(
    scene: &Scene<'_>,
    behind: usize,
    place: &Point3<f64>,
    frame: u32,
    limit: f64,
    least_m: f64,
) -> Option<Pair> {
    let front = scene.toward(frame, place)?;
    if front as usize == behind || scene.has_seen(frame, front) {
        return None;
    }
    let (near, far) = (&scene.surfels[front as usize], &scene.surfels[behind]);
    if near.points.min(far.points) < FEWEST {
        return None;
    }
    let distance_m = -near.normal.dot(&(place - near.position));
    // Shapes have their own limit.
    let variance = |surfel: &Surfel| surfel.shares.variance() + surfel.disagreement_variance();
    let sigma_m = (variance(near) + variance(far)).sqrt();
    let sight = place - scene.centres[frame as usize];
    let foot = place + sight * (distance_m / near.normal.dot(&sight));
    let is_solid = (foot - near.position).norm() <= SOLID * near.radius_m;
    let found = || Contradiction {
        front: near.position,
        front_frame: near.frames.first().copied().unwrap_or_default(),
        behind: far.position,
        seen_through_by: frame,
        distance_m,
        deviations: distance_m / sigma_m,
    };
    (is_solid && distance_m > limit * sigma_m && distance_m > least_m).then(|| Pair {
        front,
        behind: behind as u32,
        found: found(),
    })
}
