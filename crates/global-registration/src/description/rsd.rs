//! Radius-based surface descriptor `[Marton2010]`.
//!
//! On a sphere of radius r two points at distance d have normals at the angle α with `d = 2 r sin(α/2)`. Over the
//! neighbours of a point the smallest and the largest angle at each distance thus give its largest and smallest
//! radius: plane, cylinder, sphere, edge and corner differ. Two numbers are too few to be matched by; the histogram
//! of distances and angles behind them is the descriptor.

use rayon::prelude::*;

use crate::description::descriptors::DescriptorTable;
use crate::description::fpfh::dot;
use crate::description::surface::Normals;
use crate::description::surroundings::{Near, Surroundings};

const DISTANCES: usize = 5;
const ANGLES: usize = 8;
const WIDTH: usize = DISTANCES * ANGLES;
/// Radii above this multiple of the neighbourhood's count as plane.
const FLAT: f32 = 10.0;

/// Smallest and largest radius of the surface about a point, metre; infinite where it is flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceRadii {
    /// Along the direction that is bent most.
    pub smallest_m: f64,
    /// Along the direction that is bent least.
    pub largest_m: f64,
}

/// Descriptors of all points; zeros where a point has no normal.
pub(crate) fn rsd(normals: &Normals, surroundings: &Surroundings, radius: f32) -> DescriptorTable {
    let rows: Vec<[f32; WIDTH]> = (0..normals.vectors.len())
        .into_par_iter()
        .map(|i| {
            let mut histogram = [0.0; WIDTH];
            for (distance, angle) in pairs(normals, i, surroundings.of(i)) {
                let ring = ((distance / radius * DISTANCES as f32) as usize).min(DISTANCES - 1);
                let sector = ((angle / std::f32::consts::PI * ANGLES as f32) as usize).min(ANGLES - 1);
                histogram[ring * ANGLES + sector] += 1.0;
            }
            histogram
        })
        .collect();
    DescriptorTable::of_histograms(rows.as_flattened().to_vec(), WIDTH)
}

/// Distance and angle between normals for each neighbour.
fn pairs<'a>(normals: &'a Normals, i: usize, near: &'a [Near]) -> impl Iterator<Item = (f32, f32)> + 'a {
    let n = normals.vectors[i];
    near.iter().filter_map(move |near| {
        let cosine = dot(n, normals.vectors[near.index as usize]);
        let cosine = if normals.sided { cosine } else { cosine.abs() };
        // NaN, no normal, fails the comparison.
        (cosine.abs() <= 1.01).then(|| (near.squared.sqrt(), cosine.clamp(-1.0, 1.0).acos()))
    })
}

/// Both radii of a point: least-squares slopes of the distance over `2 sin(α/2)` at the smallest and the largest angles
/// of rings of distance; `None` without neighbours.
pub(crate) fn radii(normals: &Normals, surroundings: &Surroundings, radius: f32, i: usize) -> Option<SurfaceRadii> {
    let mut rings = [[f32::INFINITY, f32::NEG_INFINITY]; DISTANCES];
    let mut middles = [[0.0_f32; 2]; DISTANCES];
    for (distance, angle) in pairs(normals, i, surroundings.of(i)) {
        let ring = ((distance / radius * DISTANCES as f32) as usize).min(DISTANCES - 1);
        if angle < rings[ring][0] {
            (rings[ring][0], middles[ring][0]) = (angle, distance);
        }
        if angle > rings[ring][1] {
            (rings[ring][1], middles[ring][1]) = (angle, distance);
        }
    }
    let slope = |which: usize| {
        let (mut numerator, mut denominator) = (0.0, 0.0);
        for (ring, middle) in rings.iter().zip(&middles).filter(|(ring, _)| ring[0].is_finite()) {
            let chord = 2.0 * (ring[which] / 2.0).sin();
            numerator += chord * middle[which];
            denominator += chord * chord;
        }
        let found = numerator / denominator;
        if found < FLAT * radius { f64::from(found) } else { f64::INFINITY }
    };
    rings.iter().any(|ring| ring[0].is_finite()).then(|| SurfaceRadii { smallest_m: slope(1), largest_m: slope(0) })
}
