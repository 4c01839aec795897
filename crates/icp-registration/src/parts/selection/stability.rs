//! Selection of the points that hold the pose.

use nalgebra::{Matrix6, Vector3};

use crate::error::Result;
use crate::parts::scene::Scene;
use crate::quality::ROUNDING;
use rigid_pose::{Centred, eigen6, symmetrised};

/// The points, about `wanted` of those with a normal, that hold all six motions as evenly as the surface allows `[Gelfand2003]`.
pub(super) fn stability(scene: &Scene<'_>, wanted: usize) -> Result<Vec<usize>> {
    let points: Vec<(usize, Vector3<f64>, Vector3<f64>)> = (0..scene.source.len())
        .map(|i| (i, scene.source.points[i].coords, scene.source_normals[i]))
        .filter(|(_, _, normal)| !normal.x.is_nan())
        .collect();
    if points.len() <= wanted {
        return Ok(points.into_iter().map(|(i, _, _)| i).collect());
    }
    let holds = holds(&points)?;
    let mut chosen: Vec<usize> = greedy(&holds, wanted).into_iter().map(|k| points[k].0).collect();
    chosen.sort_unstable();
    Ok(chosen)
}

/// How much each point holds each eigen-motion of all points together: squares of `J · v`.
fn holds(points: &[(usize, Vector3<f64>, Vector3<f64>)]) -> Result<Vec<[f64; 6]>> {
    let n = points.len() as f64;
    let frame = Centred::about(points.iter().map(|(_, p, _)| *p), f64::MIN_POSITIVE.sqrt());
    let mut information = Matrix6::zeros();
    for (_, p, normal) in points {
        let j = frame.derivative(p, normal);
        information += j * j.transpose() / n;
    }
    let (_, vectors) = eigen6(&symmetrised(&information), "the stability of the surface")?;
    let squares = |(_, p, normal): &(usize, Vector3<f64>, Vector3<f64>)| {
        let along = vectors.tr_mul(&frame.derivative(p, normal));
        std::array::from_fn(|k| along[k].powi(2))
    };
    Ok(points.iter().map(squares).collect())
}

/// Takes points one by one for the motion that has least so far.
fn greedy(holds: &[[f64; 6]], wanted: usize) -> Vec<usize> {
    let queues: [Vec<usize>; 6] = std::array::from_fn(|motion| {
        let mut queue: Vec<usize> = (0..holds.len()).collect();
        // Stable: equal points stay in the order of the cloud.
        queue.sort_by(|&a, &b| holds[b][motion].total_cmp(&holds[a][motion]));
        queue
    });
    let total: [f64; 6] = std::array::from_fn(|motion| holds.iter().map(|hold| hold[motion]).sum());
    let largest = total.iter().copied().fold(0.0, f64::max);
    // Motions that no point holds would take all that are asked for.
    let holdable: Vec<usize> = (0..6).filter(|&motion| total[motion] > ROUNDING * largest).collect();
    let (mut next, mut held, mut taken) = ([0; 6], [0.0; 6], vec![false; holds.len()]);
    let mut chosen = Vec::with_capacity(wanted);
    while chosen.len() < wanted {
        let weakest = holdable.iter().copied().min_by(|&a, &b| f64::total_cmp(&held[a], &held[b]));
        let Some(weakest) = weakest else { break };
        while next[weakest] < holds.len() && taken[queues[weakest][next[weakest]]] {
            next[weakest] += 1;
        }
        let Some(&point) = queues[weakest].get(next[weakest]) else { break };
        taken[point] = true;
        chosen.push(point);
        for (sum, hold) in held.iter_mut().zip(&holds[point]) {
            *sum += hold;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_groove_of_a_plane_is_found() {
        // A plane of 2500 points and the 50 of a groove's flanks, which alone hold x.
        let plane = (0..2500).map(|i| (Vector3::new(f64::from(i % 50), f64::from(i / 50), 0.0) * 0.02, Vector3::z()));
        let groove = (0..50).map(|i| (Vector3::new(0.5, f64::from(i) * 0.02, -0.01), Vector3::x()));
        let points: Vec<_> = plane.chain(groove).enumerate().map(|(i, (p, n))| (i, p, n)).collect();
        let chosen = greedy(&holds(&points).unwrap_or_default(), 300);
        assert_eq!(chosen.len(), 300);
        // At random it would be six of the fifty.
        assert!(chosen.iter().filter(|&&k| k >= 2500).count() >= 45);
    }
}
