//! A cloud prepared for registration.

use rigid_pose::InputError;

use super::level::Level;
use super::numerics::gather::gather;
use super::numerics::lattice::{Lattice, bounds};
use super::numerics::moments::Moments;
use super::scale::voxel_size;
use crate::error::Result;
use point_cloud::Cloud;

/// Planes of a level below which it is of no use: it tells a pose too badly.
const FEWEST_PLANES: usize = 100;
/// Levels that the lattice leaves room for.
const MOST_LEVELS: usize = 8;

/// A cloud as Gaussians in voxels, in levels of doubled size. Source and target are prepared alike.
#[derive(Debug, Clone)]
pub struct VoxelCloud {
    pub(crate) lattice: Lattice,
    /// From the finest to the coarsest.
    pub(crate) levels: Vec<Level>,
    pub(crate) points: usize,
    pub(crate) radius_m: f64,
}

impl VoxelCloud {
    /// Sums up the points of each voxel and fits planes to the voxels and their neighbours.
    ///
    /// `voxel_m`: edge of the finest voxels. `None`: such that the cloud fills about 10 000 of them, or, where it has fewer points
    /// than that takes, a voxel holds about eight.
    ///
    /// Normals and standard deviations of the cloud are not used: both come from the scatter of the points. Points at
    /// the rim are left out.
    ///
    /// # Errors
    /// [`InputError::Empty`], [`InputError::NonFinite`], [`InputError::LengthMismatch`], [`InputError::NotPositive`] for the cloud;
    /// [`Error::VoxelSize`](crate::Error::VoxelSize) for a size that is not positive, or of which more than two million lie along the cloud.
    pub fn new(cloud: &Cloud, voxel_m: Option<f64>) -> Result<Self> {
        cloud.validate("the cloud of voxels")?;
        let bounds = bounds(&cloud.points);
        let size_m = match voxel_m {
            Some(size_m) => size_m,
            None => voxel_size(&cloud.points, &bounds)?,
        };
        let lattice = Lattice::within(&bounds, size_m)?;
        let rim = cloud.rim.as_deref();
        let (keys, moments) = gather::<Moments>(&cloud.points, &lattice, |i| rim.is_none_or(|r| !r[i]), &());
        if keys.is_empty() {
            return Err(InputError::Empty { what: "the cloud without its rim" }.into());
        }
        let mut levels = vec![Level::finest(&lattice, keys, moments)];
        while levels.len() < MOST_LEVELS {
            let coarser = levels[levels.len() - 1].coarser(&lattice);
            if coarser.planes().count() < FEWEST_PLANES {
                break;
            }
            levels.push(coarser);
        }
        let radius_m = radius(&levels[0]);
        Ok(Self { lattice, levels, points: cloud.len(), radius_m })
    }

    /// Edge of the finest voxels, metre.
    pub fn voxel_m(&self) -> f64 {
        self.lattice.size_m
    }

    /// Number of the finest voxels.
    pub fn len(&self) -> usize {
        self.levels[0].voxels.len()
    }

    /// Always false: a cloud without points cannot be prepared.
    pub fn is_empty(&self) -> bool {
        self.levels[0].voxels.is_empty()
    }
}

/// Root mean square distance of the points from their centroid.
fn radius(level: &Level) -> f64 {
    let total: f64 = level.voxels.iter().map(|v| v.count).sum();
    let first = level.voxels[0].mean;
    let mean =
        level.voxels.iter().fold(nalgebra::Vector3::zeros(), |sum, v| sum + (v.mean - first) * (v.count / total));
    (level.voxels.iter().map(|v| (v.mean - first - mean).norm_squared() * (v.count / total)).sum::<f64>()).sqrt()
}
