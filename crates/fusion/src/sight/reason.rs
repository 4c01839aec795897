//! Why points are in no surfel.

use rayon::prelude::*;

use super::Scene;
use crate::input::{Observation, Observations};
use crate::outcome::{Reason, Unfused};
use crate::surfels::Owner;

/// Reasons of all points without a place, by the caller's numbers.
pub(crate) fn reasons(scene: &Scene<'_>, observations: &Observations, owners: &[Owner], gate: f64) -> Vec<Unfused> {
    let mut found: Vec<Unfused> = observations
        .all
        .par_iter()
        .zip(owners)
        .with_min_len(1024)
        .filter_map(|(point, owner)| {
            let reason = match *owner {
                Owner::Place(_) => return None,
                Owner::Either(..) => Reason::AtEdge,
                Owner::Uneven => Reason::Uneven,
                Owner::Outvoted => Reason::Outvoted,
                Owner::Nobody => reason(scene, point, gate),
            };
            Some(Unfused { point: point.index as usize, reason })
        })
        .collect();
    found.sort_unstable_by_key(|unfused| unfused.point);
    found
}

fn reason(scene: &Scene<'_>, point: &Observation, gate: f64) -> Reason {
    between(scene, point, gate)
        .or_else(|| own_frame(scene, point, gate))
        .or_else(|| other_frames(scene, point, gate))
        .unwrap_or(Reason::Alone)
}

/// Height of a point over a surfel's plane, over its standard deviation.
fn deviations(scene: &Scene<'_>, point: &Observation, surfel: u32) -> f64 {
    let surfel = &scene.surfels[surfel as usize];
    let shift = point.shift().dot(&surfel.normal);
    // The point's common errors are of the size of the surfel's.
    let variance = point.noise_along(&surfel.normal) + shift * shift + 2.0 * surfel.sigma_m().powi(2);
    surfel.normal.dot(&(point.position - surfel.position)) / variance.sqrt()
}

/// Between two surfaces that its own frame has seen beside each other.
fn between(scene: &Scene<'_>, point: &Observation, gate: f64) -> Option<Reason> {
    let direction = point.position - scene.centres[point.frame as usize];
    let (mut front, mut behind) = (None, None);
    for surfel in scene.maps[point.frame as usize].around(&direction).filter(|at| scene.has_seen(point.frame, *at)) {
        let height = deviations(scene, point, surfel);
        if height < -gate {
            front.get_or_insert(surfel);
        } else if height > gate {
            behind.get_or_insert(surfel);
        }
    }
    Some(Reason::Between { front: front?, behind: behind? })
}

/// Off what is seen in its direction from its own perspective centre.
fn own_frame(scene: &Scene<'_>, point: &Observation, gate: f64) -> Option<Reason> {
    let surfel = scene.toward(point.frame, &point.position)?;
    let deviations = deviations(scene, point, surfel);
    if deviations.abs() <= gate {
        None
    } else if scene.has_seen(point.frame, surfel) {
        Some(Reason::OffSurface { surfel, deviations })
    } else {
        (deviations < 0.0).then_some(Reason::Behind { surfel, deviations: -deviations })
    }
}

/// In front of what another frame sees in its direction.
fn other_frames(scene: &Scene<'_>, point: &Observation, gate: f64) -> Option<Reason> {
    (0..scene.centres.len() as u32).filter(|frame| *frame != point.frame).find_map(|frame| {
        let surfel = scene.toward(frame, &point.position).filter(|at| scene.has_seen(frame, *at))?;
        let deviations = deviations(scene, point, surfel);
        (deviations > gate).then_some(Reason::SeenThrough { frame, surfel, deviations })
    })
}
