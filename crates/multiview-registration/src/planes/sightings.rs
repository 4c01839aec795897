//! What each station saw of each shared plane: its points given to the shared planes, summed tile by tile.
//!
//! Which shared plane a point belongs to is decided by where its ray meets them, not by where the point lies: so the decision
//! hangs on no noise. Where a ray meets two shared planes at nearly the same range, the point is left out.

use nalgebra::{Isometry3, Matrix3, Vector3};
use rayon::prelude::*;

use crate::planes::shared_planes::SharedPlane;
use crate::planes::sums::Sums;
use crate::planes::tiles::Tile;
use crate::surfaces::extents::Extent;
use crate::surfaces::plane_fit::SAME_DIRECTION;
use crate::surfaces::points::{Block, StationPoints};
use icp_registration::{RobustKernel, TUKEY};

/// For single points and for what a station saw of a tile: what is no common surface has no weight.
pub(crate) const KERNEL: RobustKernel = RobustKernel::Tukey;
/// Smallest cosine between ray and normal.
const GRAZING: f64 = 0.03;
/// Standard deviations between ranges below which they are not told apart: those of two shared planes, or of a point and what is before it.
pub(crate) const APART: f64 = 7.0;

/// The tile of a point that lies on none.
pub(crate) const NOWHERE: u32 = u32::MAX;

/// How points are given to shared planes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gate {
    /// Standard deviation that the poses add across the surfaces, metre.
    pub slack_m: f64,
    /// Of so many points one is taken.
    pub stride: usize,
    pub parameters: usize,
}

/// The sums of all stations over all tiles.
pub(crate) fn sightings(
    points: &[StationPoints],
    poses: &[Isometry3<f64>],
    shared_planes: &[SharedPlane],
    gate: Gate,
) -> Vec<Sums> {
    let wide = Wide::new(shared_planes);
    let members = members(points.len(), shared_planes);
    let stations = (0..points.len()).into_par_iter();
    stations.map(|k| Sighting::new(&points[k], &poses[k], shared_planes, gate).sums(&wide, &members[k])).collect()
}

/// The wide shared planes, by where they lie.
pub(crate) struct Wide {
    indices: Vec<usize>,
    extents: Vec<Extent>,
}

impl Wide {
    pub(crate) fn new(shared_planes: &[SharedPlane]) -> Self {
        let indices: Vec<usize> = (0..shared_planes.len()).filter(|&k| shared_planes[k].points.is_empty()).collect();
        let extents = indices.iter().map(|&k| shared_planes[k].extent()).collect();
        Self { indices, extents }
    }

    /// Those of them that are wanted.
    pub(crate) fn only(&self, is_wanted: impl Fn(usize) -> bool) -> Self {
        let kept = self.indices.iter().zip(&self.extents).filter(|(index, _)| is_wanted(**index));
        let (indices, extents) = kept.map(|(index, extent)| (*index, *extent)).unzip();
        Self { indices, extents }
    }
}

/// The points of small shared planes (shared plane, index in the cloud) of each station.
pub(crate) fn members(stations: usize, shared_planes: &[SharedPlane]) -> Vec<Vec<(u32, u32)>> {
    let mut members = vec![Vec::new(); stations];
    for (index, shared_plane) in shared_planes.iter().enumerate() {
        for &(station, point) in &shared_plane.points {
            members[station as usize].push((index as u32, point));
        }
    }
    members
}

/// Where a ray meets a shared plane.
#[derive(Debug, Clone, Copy)]
struct Hit {
    shared_plane: usize,
    tile: usize,
    kind: Tile,
    place: [f64; 2],
    cosine: f64,
    range_m: f64,
}

pub(crate) struct Sighting<'a> {
    points: &'a StationPoints,
    rotation: Matrix3<f64>,
    eye: Vector3<f64>,
    shared_planes: &'a [SharedPlane],
    gate: Gate,
    /// The tile that each point lies on; `NOWHERE` for one that does not count.
    tiles: Vec<u32>,
    hits: Vec<Hit>,
    sums: Sums,
    phi: Vec<f64>,
}

impl<'a> Sighting<'a> {
    pub(crate) fn new(
        points: &'a StationPoints,
        pose: &Isometry3<f64>,
        shared_planes: &'a [SharedPlane],
        gate: Gate,
    ) -> Self {
        Self {
            points,
            rotation: pose.rotation.to_rotation_matrix().into_inner(),
            eye: pose.translation.vector,
            shared_planes,
            gate,
            tiles: vec![NOWHERE; points.points.len()],
            hits: Vec::new(),
            sums: Sums::new(gate.parameters),
            phi: vec![1.0; 3 + gate.parameters],
        }
    }

    pub(crate) fn sums(self, wide: &Wide, members: &[(u32, u32)]) -> Sums {
        self.sums_and_tiles(wide, members).0
    }

    /// The sums, and the tile that each point lies on.
    pub(crate) fn sums_and_tiles(mut self, wide: &Wide, members: &[(u32, u32)]) -> (Sums, Vec<u32>) {
        let in_reach = self.in_reach(wide);
        let mut near = Vec::new();
        for block in &self.points.blocks {
            self.near(block, &in_reach, &mut near);
            for point in block.points.clone().step_by(self.gate.stride) {
                let (direction, range_m) = self.ray(point);
                if let Some(hit) = self.shared_plane_of(point, &direction, range_m, &near) {
                    let plane = &self.shared_planes[hit.shared_plane];
                    let rho = plane.normal.dot(&(self.eye + direction * range_m - plane.origin));
                    self.weigh(point, &hit, rho);
                }
            }
        }
        for &(shared_plane, point) in members {
            self.add_member(self.points.slot_of[point as usize] as usize, shared_plane as usize);
        }
        self.sums.close();
        self.sums.free_derivatives_of_noise();
        (self.sums, self.tiles)
    }

    /// How far from the middle of a block its points may meet a shared plane, metre.
    fn reach_m(&self, block: &Block) -> f64 {
        1.5 * (block.radius_m + 10.0 * self.gate.slack_m)
    }

    fn centre(&self, block: &Block) -> Vector3<f64> {
        self.rotation * block.centre.coords + self.eye
    }

    /// Wide shared planes that any point of the station may lie on, ascending.
    fn in_reach(&self, wide: &Wide) -> Vec<usize> {
        // In reach along each axis of the plane is within the square root of three along those of the world.
        let farthest_m = |block: &Block| 1.8 * self.reach_m(block);
        let blocks = self.points.blocks.iter().map(|block| Extent::about(&self.centre(block), farthest_m(block)));
        let Some(own) = blocks.reduce(|a, b| a.joined(&b)) else { return Vec::new() };
        let near = wide.extents.iter().zip(&wide.indices).filter(|(extent, _)| extent.meets(&own, 0.0));
        near.map(|(_, &index)| index).collect()
    }

    /// Wide shared planes that points of a block may lie on.
    fn near(&self, block: &Block, in_reach: &[usize], near: &mut Vec<usize>) {
        near.clear();
        let (centre, reach_m) = (self.centre(block), self.reach_m(block));
        near.extend(in_reach.iter().copied().filter(|&index| {
            let shared_plane = &self.shared_planes[index];
            let across = shared_plane.normal.dot(&(centre - shared_plane.origin)).abs();
            across <= reach_m && shared_plane.tiles.near(shared_plane.place(&centre), reach_m)
        }));
    }

    /// Range along the ray of a point and the point's own.
    fn ray(&self, point: usize) -> (Vector3<f64>, f64) {
        let turned = self.rotation * self.points.points[point].coords;
        let range = turned.norm();
        (turned / range, range)
    }

    /// Standard deviation of a point across a shared plane, metre.
    fn sigma(&self, point: usize, cosine: f64) -> f64 {
        (self.points.variance(point, cosine) + self.gate.slack_m.powi(2)).sqrt()
    }

    /// Where the ray of a point meets a shared plane; `None` also where that is too far off to matter.
    fn hit(&self, point: usize, shared_plane: usize, direction: &Vector3<f64>, range_m: f64) -> Option<Hit> {
        let plane = &self.shared_planes[shared_plane];
        let ahead = if self.points.along_rays { *direction } else { -plane.normal };
        let cosine = plane.normal.dot(&ahead);
        let rho = plane.normal.dot(&(self.eye + direction * range_m - plane.origin));
        if cosine > -GRAZING || rho.abs() > (TUKEY + APART) * self.sigma(point, cosine) {
            return None;
        }
        // Without rays, the point is moved along the normal.
        let from = if self.points.along_rays { self.eye } else { self.eye + direction * range_m };
        let ahead_m = plane.normal.dot(&(plane.origin - from)) / cosine;
        let place = plane.place(&(from + ahead * ahead_m));
        let (tile, kind) = plane.tiles.at(place);
        let range_m = if self.points.along_rays { ahead_m } else { range_m + ahead_m };
        (kind != Tile::Outside).then_some(Hit { shared_plane, tile, kind, place, cosine, range_m })
    }

    /// Where the point lies, if that is certain.
    fn shared_plane_of(&mut self, point: usize, direction: &Vector3<f64>, range_m: f64, near: &[usize]) -> Option<Hit> {
        self.hits.clear();
        for &shared_plane in near {
            self.hits.extend(self.hit(point, shared_plane, direction, range_m));
        }
        let off = |hit: &Hit| (range_m - hit.range_m).abs();
        let mut best = *self.hits.iter().min_by(|a, b| off(a).total_cmp(&off(b)))?;
        for other in &self.hits {
            let apart = (other.range_m - best.range_m).abs();
            let sigma_m = self.sigma(point, best.cosine) / best.cosine.abs();
            if other.shared_plane == best.shared_plane || apart > APART * sigma_m {
                continue;
            }
            let (first, second) = (&self.shared_planes[best.shared_plane], &self.shared_planes[other.shared_plane]);
            if first.normal.dot(&second.normal) < SAME_DIRECTION {
                return None;
            }
            // Pieces of one surface: the one that was seen there, or the one that is better known.
            let rank = |hit: &Hit, shared_plane: &SharedPlane| (hit.kind == Tile::Core, shared_plane.size);
            if rank(other, second) > rank(&best, first) {
                best = *other;
            }
        }
        Some(best)
    }

    /// A point of a small shared plane.
    fn add_member(&mut self, point: usize, index: usize) {
        if self.tiles.get(point) != Some(&NOWHERE) {
            return;
        }
        let (direction, range_m) = self.ray(point);
        let shared_plane = &self.shared_planes[index];
        let place = self.eye + direction * range_m;
        let hit = Hit {
            shared_plane: index,
            tile: shared_plane.tiles.first,
            kind: Tile::Core,
            place: shared_plane.place(&place),
            cosine: shared_plane.normal.dot(&direction),
            range_m,
        };
        let rho = shared_plane.normal.dot(&(place - shared_plane.origin));
        self.weigh(point, &hit, rho);
    }

    /// Adds a point at a distance from its shared plane, if it counts there.
    fn weigh(&mut self, point: usize, hit: &Hit, rho: f64) {
        let sigma = self.sigma(point, hit.cosine);
        let whitened = rho / sigma;
        // An unknown deviation is no weight.
        if whitened.is_nan() || whitened.abs() > TUKEY || !sigma.is_normal() {
            return;
        }
        let weight = KERNEL.weight(whitened) / sigma.powi(2);
        self.phi[1..3].copy_from_slice(&hit.place);
        let parameters = self.gate.parameters;
        if parameters > 0 {
            let normal = self.rotation.transpose() * self.shared_planes[hit.shared_plane].normal;
            let derivatives = &self.points.derivatives[point * parameters..(point + 1) * parameters];
            for (phi, derivative) in self.phi[3..].iter_mut().zip(derivatives) {
                *phi = normal.dot(&Vector3::from(*derivative));
            }
        }
        self.sums.add(hit.tile, &self.phi, rho, weight);
        self.tiles[point] = hit.tile as u32;
    }
}
