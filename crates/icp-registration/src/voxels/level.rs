//! One level of a voxel cloud: a plane for each voxel, and the way from a point to the voxels near it.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::numerics::blocks::Blocks;
use super::numerics::lattice::{Lattice, cell};
use super::numerics::moments::Moments;
use crate::system::CHUNK;
use point_cloud::{SAME_SURFACE_COSINE, eigenvalues3, eigenvector3};

/// Fewest points and voxels that a plane is fitted to.
const FEWEST_POINTS: f64 = 6.0;
const FEWEST_VOXELS: usize = 3;
/// Largest ratio of the smallest to the middle eigenvalue: beyond it the neighbourhood is no plane but an edge or noise.
const LARGEST_FLATNESS_RATIO: f64 = 0.15;
/// Smallest middle eigenvalue, in squares of the voxel: below, the points lie on a line.
const SMALLEST_WIDTH: f64 = 0.02;
/// Share of the points' variance across the plane that does not average out: bends, steps, the edge of a surface.
const COMMON_SHARE: f64 = 0.03;
/// Standard deviation that no plane goes below, in voxels: surfaces are not flatter, and a few voxels with many points
/// would outweigh all others.
const FLOOR: f64 = 0.02;

/// The mean of the points of a surface in a voxel and in those before and behind it, and the plane through it and its
/// neighbours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Voxel {
    pub mean: Point3<f64>,
    /// Unit normal of arbitrary sign; NaN where the points form no plane.
    pub normal: Vector3<f64>,
    /// Variance of the mean across the plane, square metre; infinite where there is no plane.
    pub variance: f64,
    pub count: f64,
}

/// All voxels of one size.
#[derive(Debug, Clone)]
pub(crate) struct Level {
    pub size_m: f64,
    /// Cells of the finest level along the edge of a cell of this one.
    factor: f64,
    keys: Vec<u64>,
    moments: Vec<Moments>,
    blocks: Blocks,
    pub voxels: Vec<Voxel>,
}

impl Level {
    /// The finest level.
    pub fn finest(lattice: &Lattice, keys: Vec<u64>, moments: Vec<Moments>) -> Self {
        Self::new(lattice, 1.0, keys, moments)
    }

    /// The level of twice the size.
    pub fn coarser(&self, lattice: &Lattice) -> Self {
        let (mut keys, mut moments) = (Vec::<u64>::new(), Vec::<Moments>::new());
        for (key, own) in self.keys.iter().zip(&self.moments) {
            let shift = [0, 1, 2].map(|axis| if key >> axis & 1 == 1 { 0.5 } else { -0.5 });
            let part = own.shifted(shift).in_doubled_units();
            match moments.last_mut() {
                Some(last) if keys.last() == Some(&(key >> 3)) => last.include(&part),
                _ => {
                    keys.push(key >> 3);
                    moments.push(part);
                }
            }
        }
        Self::new(lattice, 2.0 * self.factor, keys, moments)
    }

    fn new(lattice: &Lattice, factor: f64, keys: Vec<u64>, moments: Vec<Moments>) -> Self {
        let blocks = Blocks::new(&keys);
        let size_m = lattice.size_m * factor;
        let maker = Maker { lattice, factor, keys: &keys, moments: &moments, blocks: &blocks };
        let voxels = (0..keys.len()).into_par_iter().with_min_len(CHUNK).map(|i| maker.voxel(i)).collect();
        Self { size_m, factor, keys, moments, blocks, voxels }
    }

    /// The voxels that have a plane.
    pub fn planes(&self) -> impl Iterator<Item = &Voxel> {
        self.voxels.iter().filter(|voxel| voxel.variance < f64::INFINITY)
    }

    /// Index of the voxel nearest to `moved` whose normal agrees with `normal`, among the eight cells around it.
    #[inline]
    pub fn partner(&self, lattice: &Lattice, moved: &Point3<f64>, normal: &Vector3<f64>) -> Option<usize> {
        let place = lattice.place(moved).map(|v| v / self.factor);
        // NaN and what lies outside fail the comparison.
        if !place.iter().all(|v| *v >= 1.0 && *v < 2_000_000.0) {
            return None;
        }
        let cells = place.map(|v| {
            let c = v as u32;
            [c, if v - f64::from(c) < 0.5 { c - 1 } else { c + 1 }]
        });
        let (mut best, mut nearest) = (f64::INFINITY, None);
        self.blocks.visit(cells, |_, index| {
            let voxel = &self.voxels[index];
            let square = (voxel.mean - moved).norm_squared();
            // A NaN normal fails the comparison.
            if square < best && voxel.normal.dot(normal).abs() > SAME_SURFACE_COSINE {
                (best, nearest) = (square, Some(index));
            }
        });
        nearest
    }
}

struct Maker<'a> {
    lattice: &'a Lattice,
    factor: f64,
    keys: &'a [u64],
    moments: &'a [Moments],
    blocks: &'a Blocks,
}

impl Maker<'_> {
    fn voxel(&self, index: usize) -> Voxel {
        let (cell, own) = (cell(self.keys[index]), &self.moments[index]);
        let plane = self.plane(cell, own, index);
        let (points, normal, variance) = plane.unwrap_or((*own, Vector3::repeat(f64::NAN), f64::INFINITY));
        let mean = points.mean();
        let place = [0, 1, 2].map(|k| (f64::from(cell[k]) + 0.5 + mean[k]) * self.factor);
        Voxel { mean: self.lattice.point(&place), normal, variance, count: points.count }
    }

    /// The points that the mean is taken of, the normal, and the variance of the mean across the plane, square metre.
    ///
    /// Noise spreads a surface over several cells, and the mean of those that fell into one of them lies off it: the more
    /// points, the more cells hold nothing but such outliers. So the cells before and behind along the axis nearest to the
    /// normal are taken together, by the one of them with the most points; the others have no plane.
    fn plane(&self, cell: [u32; 3], own: &Moments, own_index: usize) -> Option<(Moments, Vector3<f64>, f64)> {
        let (mut around, mut voxels) = (Moments::default(), 0);
        let (mut columns, mut strongest) = ([*own; 3], [true; 3]);
        self.blocks.visit(cell.map(|c| [c - 1, c, c + 1]), |place, index| {
            let steps = [place % 3, place / 3 % 3, place / 9];
            let moments = self.moments[index].shifted(steps.map(|c| c as f64 - 1.0));
            around.include(&moments);
            voxels += 1;
            for axis in 0..3 {
                if steps[axis] != 1 && steps[(axis + 1) % 3] == 1 && steps[(axis + 2) % 3] == 1 {
                    columns[axis].include(&moments);
                    strongest[axis] &= (own.count, index) > (moments.count, own_index);
                }
            }
        });
        if around.count < FEWEST_POINTS || voxels < FEWEST_VOXELS {
            return None;
        }
        let scatter = around.scatter();
        let [smallest, middle, _] = eigenvalues3(&scatter);
        if !(smallest <= LARGEST_FLATNESS_RATIO * middle && middle > SMALLEST_WIDTH) {
            return None;
        }
        let normal = eigenvector3(&scatter, smallest)?;
        let axis = normal.iamax();
        if !strongest[axis] {
            return None;
        }
        let column = columns[axis];
        let across = smallest.max(normal.dot(&(column.scatter() * normal))).max(0.0);
        let size_m = self.lattice.size_m * self.factor;
        let variance = across * (1.0 / column.count + COMMON_SHARE) + FLOOR * FLOOR;
        Some((column, normal, variance * size_m * size_m))
    }
}
