//! Where fused points will be: one a cell on each surface that runs through it.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::{Patch, Patches, Plane};
use crate::input::Observation;
use crate::lattice::{Lattice, Runs, neighbour, neighbours};
use crate::small;

/// Cosine of the angle beyond which two planes are two surfaces, 30°: a surface that bends more within a cell has no plane.
pub(crate) const ONE_SURFACE: f64 = 0.866;
/// Farthest distance of a place from the centre of its cell along an axis, cells. A half and what noise moves planes by.
const IN_CELL: f64 = 0.55;
/// Least distance of places on one surface, cells: that of cells seen along their diagonal.
const LEAST_DISTANCE: f64 = 0.7;
/// Heights, cells, by which planes of one surface differ although nothing errs: through windows at edges and on curved surfaces.
const SHAPE: f64 = 0.1;
/// The same of one frame.
const SHAPE_IN_FRAME: f64 = 0.25;

/// Largest standard deviation of a plane in the cell beside its own, cells: less certain ones meet what they do not belong to.
const LARGEST_EXTENSION: f64 = 0.2;

/// Where a surface is, before its points are gathered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seed {
    pub anchor: Point3<f64>,
    pub normal: Vector3<f64>,
    /// Of the height at the anchor with common errors, square metre.
    pub variance: f64,
    /// The part of common errors.
    pub common: f64,
    /// Of the inclination, square radian.
    pub tilt_variance: f64,
    pub frame: u32,
    pub layer: u32,
    /// Whether the plane is that of a cell beside, whose surface may end before, or of the points of its cell alone, which may be
    /// an edge.
    pub is_weak: bool,
}

impl Seed {
    /// Variance of the noise of a point along the normal; where light grazes, the error of the normal decides on it.
    pub fn noise(&self, point: &Observation) -> f64 {
        point.noise_along(&self.normal) + point.noise_variance() * self.tilt_variance
    }
}

/// Seeds with their cells in ascending order of the keys.
pub(crate) fn seeds(patches: &Patches, lattice: &Lattice, layers: &[u32], gate: f64) -> Vec<(u64, Seed)> {
    let near = neighbours(1);
    let by_cell: Vec<Vec<Seed>> = (0..patches.cells.keys.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|cell| in_cell(cell, patches, lattice, layers, gate, &near))
        .collect();
    apart(&by_cell, &patches.cells, lattice, gate, &near)
}

fn in_cell(cell: usize, patches: &Patches, lattice: &Lattice, layers: &[u32], gate: f64, near: &[i64]) -> Vec<Seed> {
    let key = patches.cells.keys[cell];
    let centre = lattice.centre(key);
    let seed = |patch: &Patch| Some(placed(&patch.plane?, patch, &centre, layers[patch.frame as usize]));
    let order = |a: &Seed, b: &Seed| {
        // Firm ones first, then those that are known best.
        let numbers = |s: &Seed| [f64::from(u8::from(s.is_weak)), s.variance, s.anchor.x, s.anchor.y, s.anchor.z];
        let pairs = numbers(a).into_iter().zip(numbers(b));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    };
    let mut own: Vec<Seed> = patches.of(cell).iter().filter_map(seed).collect();
    own.sort_by(order);
    let mut kept: Vec<Seed> = Vec::new();
    for seed in own {
        if !kept.iter().any(|other| is_same(&seed, other, lattice.size_m, gate)) {
            kept.push(seed);
        }
    }
    // Planes of the cells beside: at edges, where the cell itself shows none. A plane of nearly the same direction serves.
    let mut beside: Vec<Seed> = Vec::new();
    for difference in near.iter().filter(|difference| **difference != 0) {
        let Some(other) = patches.cells.find(neighbour(key, *difference)) else { continue };
        let of_frames = patches.of(other).iter().filter(|patch| patches.by_frame(cell, patch.frame).is_some());
        let extended = of_frames.filter_map(seed).map(|seed| Seed { is_weak: true, ..seed });
        beside.extend(extended.filter(|seed| {
            is_inside(seed, &centre, lattice.size_m)
                && seed.variance - seed.common < (LARGEST_EXTENSION * lattice.size_m).powi(2)
        }));
    }
    beside.sort_by(order);
    for seed in beside {
        if !kept.iter().any(|other| is_parallel(&seed, other, lattice.size_m)) {
            kept.push(seed);
        }
    }
    kept.retain(|seed| is_inside(seed, &centre, lattice.size_m));
    kept
}

fn placed(plane: &Plane, patch: &Patch, centre: &Point3<f64>, layer: u32) -> Seed {
    let anchor = centre - plane.normal * plane.normal.dot(&(centre - plane.point));
    let common = small::quadratic(&patch.common, &plane.normal);
    let variance = plane.variance + plane.tilt_variance * (anchor - plane.point).norm_squared() + common;
    let tilt_variance = plane.tilt_variance;
    Seed {
        anchor,
        normal: plane.normal,
        variance,
        common,
        tilt_variance,
        frame: patch.frame,
        layer,
        is_weak: !plane.is_firm,
    }
}

fn is_inside(seed: &Seed, centre: &Point3<f64>, voxel_m: f64) -> bool {
    (seed.anchor - centre).amax() <= IN_CELL * voxel_m
}

/// Whether two seeds are of one surface, as far as their errors can tell.
fn is_same(a: &Seed, b: &Seed, voxel_m: f64, gate: f64) -> bool {
    let shape = if a.frame == b.frame { SHAPE_IN_FRAME } else { SHAPE };
    let height = b.normal.dot(&(a.anchor - b.anchor)).abs();
    a.layer == b.layer
        && a.normal.dot(&b.normal) > ONE_SURFACE
        && height <= gate * (a.variance + b.variance).sqrt() + shape * voxel_m
}

/// Whether a surface of nearly the same direction lies there already.
fn is_parallel(a: &Seed, b: &Seed, voxel_m: f64) -> bool {
    let height = b.normal.dot(&(a.anchor - b.anchor)).abs();
    a.layer == b.layer && a.normal.dot(&b.normal) > ONE_SURFACE && height <= voxel_m
}

/// Leaves out seeds next to earlier ones of their surface.
fn apart(by_cell: &[Vec<Seed>], cells: &Runs, lattice: &Lattice, gate: f64, near: &[i64]) -> Vec<(u64, Seed)> {
    let least = LEAST_DISTANCE * lattice.size_m;
    let mut kept: Vec<Vec<Seed>> = vec![Vec::new(); by_cell.len()];
    // Firm ones of all cells first.
    let cells_twice = (0..2 * by_cell.len()).map(|at| (at % by_cell.len(), at >= by_cell.len()));
    for (cell, is_weak) in cells_twice {
        let seeds: Vec<&Seed> = by_cell[cell].iter().filter(|seed| seed.is_weak == is_weak).collect();
        if seeds.is_empty() {
            continue;
        }
        let around: Vec<usize> =
            near.iter().filter_map(|difference| cells.find(neighbour(cells.keys[cell], *difference))).collect();
        for seed in seeds {
            let mut others = around.iter().flat_map(|cell| &kept[*cell]);
            let is_taken = others
                .any(|other| (other.anchor - seed.anchor).norm() < least && is_same(seed, other, lattice.size_m, gate));
            if !is_taken {
                kept[cell].push(*seed);
            }
        }
    }
    cells.keys.iter().zip(kept).flat_map(|(key, seeds)| seeds.into_iter().map(move |seed| (*key, seed))).collect()
}
