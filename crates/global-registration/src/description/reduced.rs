//! A cloud averaged in voxels, in single precision about its middle, sorted by coarse cells.

use nalgebra::{Point3, Vector3};
use rigid_pose::InputError;

use crate::cells::{CellTable, key_of};
use crate::description::feature_cloud::LEAST_POINTS;
use crate::error::Result;
use point_cloud::{Cloud, middle_and_radius};

/// Points that the middle and the size of a cloud are taken from.
const SIZE_SAMPLES: usize = 4096;
/// Median distance from the middle, in voxels, where no voxel is given.
const VOXELS_IN_RADIUS: f64 = 24.0;
/// Voxels must hold this many points on average, or they are finer than the cloud.
const LEAST_POINTS_PER_VOXEL: f64 = 1.5;

/// Averages of voxels.
#[derive(Debug, Clone)]
pub(crate) struct Reduced {
    /// Middle that the points are relative to, in the cloud's frame.
    pub(crate) middle: Vector3<f64>,
    pub(crate) voxel_m: f64,
    /// Relative to the middle, metre.
    pub(crate) points: Vec<[f32; 3]>,
    /// Averages of the normals that came with the cloud (any length); zero without.
    pub(crate) given_normals: Vec<[f32; 3]>,
}

#[derive(Clone, Copy, Default)]
struct Sum {
    point: [f64; 3],
    normal: [f32; 3],
    count: u32,
}

impl Reduced {
    /// Averages the points of the voxels; points at the rim are left out.
    pub(crate) fn new(cloud: &Cloud, voxel_m: Option<f64>) -> Result<Self> {
        let (middle, radius) = middle_and_radius(&cloud.points, SIZE_SAMPLES);
        let mut voxel = voxel_m.unwrap_or_else(|| on_ladder(radius / VOXELS_IN_RADIUS));
        if !(voxel > 0.0 && voxel.is_finite()) {
            return Err(InputError::TooFewPoints { what: "cloud of features", found: 1, needed: LEAST_POINTS }.into());
        }
        loop {
            let (reduced, count) = Self::with_voxel(cloud, middle, voxel);
            let coarse_enough = count as f64 >= LEAST_POINTS_PER_VOXEL * reduced.points.len() as f64;
            if voxel_m.is_some() || coarse_enough || voxel > radius {
                return Ok(reduced);
            }
            voxel *= std::f64::consts::SQRT_2;
        }
    }

    fn with_voxel(cloud: &Cloud, middle: Vector3<f64>, voxel_m: f64) -> (Self, usize) {
        let per_cell = (1.0 / voxel_m) as f32;
        let mut table = CellTable::new(16_384);
        let mut keys: Vec<u64> = Vec::new();
        let mut sums: Vec<Sum> = Vec::new();
        let mut last = (u64::MAX, 0);
        let mut count = 0;
        for (i, point) in cloud.points.iter().enumerate() {
            if cloud.rim.as_ref().is_some_and(|rim| rim[i]) {
                continue;
            }
            let relative = point.coords - middle;
            let Some(key) = key_of([relative.x as f32, relative.y as f32, relative.z as f32], per_cell) else {
                continue;
            };
            // Neighbours in the cloud are mostly neighbours in space.
            if key != last.0 {
                let (slot, is_new) = table.get_or_insert(key, sums.len() as u32);
                if is_new {
                    keys.push(key);
                    sums.push(Sum::default());
                }
                last = (key, slot as usize);
            }
            let sum = &mut sums[last.1];
            sum.count += 1;
            count += 1;
            for (total, c) in sum.point.iter_mut().zip(relative.iter()) {
                *total += c;
            }
            let Some(normal) = cloud.normals.as_ref().map(|n| &n[i]).filter(|n| n.iter().all(|c| c.is_finite())) else {
                continue;
            };
            for (total, c) in sum.normal.iter_mut().zip(normal.iter()) {
                *total += *c as f32;
            }
        }
        let points = sums.iter().map(|s| s.point.map(|c| (c / f64::from(s.count)) as f32)).collect();
        let given_normals = sums.iter().map(|s| s.normal).collect();
        (Self { middle, voxel_m, points, given_normals }, count)
    }

    pub(crate) fn len(&self) -> usize {
        self.points.len()
    }

    /// Puts the points into this order.
    pub(crate) fn reorder(&mut self, order: &[u32]) {
        self.points = order.iter().map(|&i| self.points[i as usize]).collect();
        self.given_normals = order.iter().map(|&i| self.given_normals[i as usize]).collect();
    }

    /// A point in the cloud's frame.
    pub(crate) fn point(&self, index: usize) -> Point3<f64> {
        Point3::from(self.middle + Vector3::from(self.points[index].map(f64::from)))
    }
}

/// Nearest power of the square root of two: clouds of like size get the same voxels.
fn on_ladder(length: f64) -> f64 {
    ((2.0 * length.log2()).round() / 2.0).exp2()
}
