//! Which point belongs to which place.
//!
//! Points belong where their ray meets a plane, not where noise has put them: what decides on a point then does not know
//! its error, and no choice bends the mean. The height alone is tested, at one level, with all that may be wrong with it.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::input::{Observation, Observations};
use crate::lattice::{Lattice, Runs, neighbour, neighbours};
use crate::patches::{LEAST_FACING, ONE_SURFACE, Patches, Seed};
use crate::small;

/// Distance from a place within which points are its own, cells: places lie less than twice that apart.
const REACH: f64 = 1.0;
/// Distance from a place within which it certainly hides what is behind it, cells.
const HIDES: f64 = 0.6;
/// Half the diagonal of a cell.
const HALF_DIAGONAL: f64 = 0.8661;
/// Farthest cells that are looked at. Noise beyond is refused before.
pub(crate) const FARTHEST: usize = 4;

/// What a point belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Owner {
    /// To none.
    Nobody,
    /// To a place.
    Place(u32),
    /// To a place whose points lie on no plane.
    Uneven,
    /// To a place that cannot be there beside what more frames saw.
    Outvoted,
    /// To one of two surfaces that meet there, by the numbers of the places that were chosen from.
    Either(u32, u32),
}

/// Places by cells of twice the size: fewer cells to look at.
pub(crate) struct Places<'a> {
    cells: Runs,
    by_cell: Vec<u32>,
    seeds: &'a [(u64, Seed)],
}

impl<'a> Places<'a> {
    pub fn new(seeds: &'a [(u64, Seed)]) -> Self {
        let mut order: Vec<(u64, u32)> =
            seeds.iter().enumerate().map(|(at, (key, _))| (Lattice::doubled(*key), at as u32)).collect();
        order.sort_unstable();
        let cells = Runs::new(order.iter().map(|(key, _)| *key));
        Self { cells, by_cell: order.into_iter().map(|(_, at)| at).collect(), seeds }
    }
}

/// The owner of each point.
pub(crate) fn owners(
    observations: &Observations,
    patches: &Patches,
    places: &Places<'_>,
    layers: &[u32],
    gate: f64,
) -> Vec<Owner> {
    let near: Vec<Vec<i64>> = (0..=FARTHEST as i64).step_by(2).map(|reach| neighbours(reach / 2)).collect();
    let cells = &patches.cells;
    let mut order: Vec<(u64, u32)> =
        cells.keys.iter().enumerate().map(|(cell, key)| (Lattice::doubled(*key), cell as u32)).collect();
    order.par_sort_unstable();
    let blocks: Vec<&[(u64, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    let surroundings = Surroundings { observations, patches, places, gate };
    let by_block: Vec<Vec<Owner>> = blocks
        .par_iter()
        .with_min_len(8)
        .map(|block| {
            let around = surroundings.of_block(block, &near);
            let mut owners = Vec::new();
            for (_, cell) in *block {
                let cell = *cell as usize;
                let around = surroundings.of_cell(cell, &around);
                let mut chooser = Chooser { around, voxel_m: observations.lattice.size_m, gate, near: Vec::new() };
                owners.extend(observations.all[cells.items(cell)].iter().map(|point| {
                    let common = patches.by_frame(cell, point.frame).map_or([0.0; 6], |patch| patch.common);
                    chooser.owner(point, &common, layers[point.frame as usize])
                }));
            }
            owners
        })
        .collect();
    let mut owners = vec![Owner::Nobody; observations.all.len()];
    for (block, of_block) in blocks.into_iter().zip(by_block) {
        let points = block.iter().flat_map(|(_, cell)| cells.items(*cell as usize));
        for (point, owner) in points.zip(of_block) {
            owners[point] = owner;
        }
    }
    owners
}

/// What is asked for the places around cells.
struct Surroundings<'a, 'b> {
    observations: &'b Observations,
    patches: &'b Patches,
    places: &'b Places<'a>,
    gate: f64,
}

impl<'a> Surroundings<'a, '_> {
    /// Largest variance of a point of a cell along any direction.
    fn variance(&self, cell: usize) -> f64 {
        let points = &self.observations.all[self.patches.cells.items(cell)];
        let noise = points.iter().map(Observation::variance).fold(0.0, f64::max);
        let patches = self.patches.of(cell).iter();
        noise + patches.map(|p| p.common[0] + p.common[3] + p.common[5]).fold(0.0, f64::max)
    }

    /// The places that points of some cells of a cell of twice the size may belong to.
    fn of_block(&self, block: &[(u64, u32)], near: &[Vec<i64>]) -> Vec<(u32, &'a Seed)> {
        let voxel_m = self.observations.lattice.size_m;
        let variance = block.iter().map(|(_, cell)| self.variance(*cell as usize)).fold(0.0, f64::max);
        let reach = (REACH + self.gate * variance.sqrt() / voxel_m).clamp(2.0, FARTHEST as f64);
        let keys = near[(0.5 * reach).ceil() as usize].iter().map(|by| neighbour(block[0].0, *by));
        let at = keys.flat_map(|key| self.places.cells.of(key)).map(|at| self.places.by_cell[at]);
        at.map(|at| (at, &self.places.seeds[at as usize].1)).collect()
    }

    /// Those of a cell among them.
    fn of_cell(&self, cell: usize, around: &[(u32, &'a Seed)]) -> Vec<(u32, &'a Seed)> {
        let lattice = &self.observations.lattice;
        let centre = lattice.centre(self.patches.cells.keys[cell]);
        let variance = self.variance(cell);
        let is_near = |seed: &Seed| {
            let apart = centre - seed.anchor;
            let depth = self.gate * (variance + seed.variance).sqrt();
            seed.normal.dot(&apart).abs() < depth + HALF_DIAGONAL * lattice.size_m
                && apart.norm() < depth + (HALF_DIAGONAL + REACH) * lattice.size_m
        };
        around.iter().filter(|(_, seed)| is_near(seed)).copied().collect()
    }
}

/// A place whose surface a point may be of.
#[derive(Debug, Clone, Copy)]
struct PlaceInReach {
    place: u32,
    at: usize,
    /// Where the ray meets the plane.
    foot: Point3<f64>,
    /// Height of the point over its standard deviation.
    normalised: f64,
    sigma: f64,
    lateral_2: f64,
}

struct Chooser<'a> {
    around: Vec<(u32, &'a Seed)>,
    voxel_m: f64,
    gate: f64,
    near: Vec<PlaceInReach>,
}

impl Chooser<'_> {
    fn owner(&mut self, point: &Observation, common: &small::Symmetric, layer: u32) -> Owner {
        let reach_2 = (REACH * self.voxel_m).powi(2);
        self.near.clear();
        for (at, (place, seed)) in self.around.iter().enumerate() {
            let facing = -seed.normal.dot(&point.ray);
            if seed.layer != layer || facing < LEAST_FACING {
                continue;
            }
            let height = seed.normal.dot(&(point.position - seed.anchor));
            let foot = point.position + point.ray * (height / facing);
            let lateral_2 = (foot - seed.anchor).norm_squared();
            if lateral_2 > reach_2 {
                continue;
            }
            let sigma = sigma(point, common, seed);
            let normalised = height.abs() / sigma;
            if normalised <= self.gate {
                self.near.push(PlaceInReach { place: *place, at, foot, normalised, sigma, lateral_2 });
            }
        }
        let Some(nearest) = self.near.iter().min_by(|a, b| a.normalised.total_cmp(&b.normalised)) else {
            return Owner::Nobody;
        };
        let surface = self.around[nearest.at].1;
        // Of the places on the same surface, the one that is nearest beside.
        let same = self.near.iter().filter(|other| {
            let seed = self.around[other.at].1;
            seed.normal.dot(&surface.normal) > ONE_SURFACE
                && seed.normal.dot(&(nearest.foot - seed.anchor)).abs() <= 0.5 * self.gate * nearest.sigma
        });
        let best = same.min_by(|a, b| a.lateral_2.total_cmp(&b.lateral_2)).unwrap_or(nearest);
        match self.crossing(point, common, layer, best) {
            Some(other) => Owner::Either(best.place, other),
            None => Owner::Place(best.place),
        }
    }

    /// A surface of another direction that a point of the chosen one could belong to, wherever noise has put it, or that hides
    /// the chosen one from it.
    fn crossing(&self, point: &Observation, common: &small::Symmetric, layer: u32, best: &PlaceInReach) -> Option<u32> {
        let normal = self.around[best.at].1.normal;
        let reach_2 = (REACH * self.voxel_m).powi(2);
        let hidden_2 = (HIDES * self.voxel_m).powi(2);
        let crosses = |seed: &Seed| {
            let facing = -seed.normal.dot(&point.ray);
            if seed.layer != layer || seed.normal.dot(&normal) > ONE_SURFACE || facing < LEAST_FACING {
                return false;
            }
            let apart = best.foot - seed.anchor;
            let height = seed.normal.dot(&apart);
            let meets = apart.norm_squared() - height * height <= reach_2
                && height.abs() <= self.gate * sigma(point, common, seed);
            let before = apart + point.ray * (height / facing);
            meets || (height < 0.0 && before.norm_squared() <= hidden_2)
        };
        self.around.iter().find(|(_, seed)| crosses(seed)).map(|(place, _)| *place)
    }
}

/// Standard deviation of the height of a point over a place.
fn sigma(point: &Observation, common: &small::Symmetric, seed: &Seed) -> f64 {
    let n: &Vector3<f64> = &seed.normal;
    (point.noise_along(n) + point.shift().dot(n).powi(2) + small::quadratic(common, n) + seed.variance).sqrt()
}

/// The points of each place, in their order: starts, and points.
pub(crate) fn members(owners: &[Owner], places: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; places + 1];
    for owner in owners {
        if let Owner::Place(place) = owner {
            starts[*place as usize + 1] += 1;
        }
    }
    for place in 0..places {
        starts[place + 1] += starts[place];
    }
    let mut next = starts.clone();
    let mut points = vec![0_u32; starts[places] as usize];
    for (at, owner) in owners.iter().enumerate() {
        if let Owner::Place(place) = owner {
            let slot = &mut next[*place as usize];
            points[*slot as usize] = at as u32;
            *slot += 1;
        }
    }
    (starts, points)
}
