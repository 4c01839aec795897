use crate::error::Result;
use rigid_pose::{require_option, require_positive};

/// Edge of a voxel, metre: that of crate `fusion`. Smaller, and shapes are kept finer, in more points, each averaged over less.
const VOXEL_M: f64 = 0.05;
/// Points of a map. Each takes some 130 bytes, so the map stays below 130 MB; in voxels of 0.05 m they are 2,500 m² of walls.
const MOST_POINTS: usize = 1_000_000;

/// How fine a [`SurfaceMap`](crate::SurfaceMap) is, and how large it may become.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapOptions {
    /// Edge of a voxel, metre. Default: 0.05.
    pub voxel_m: f64,
    /// Most points. A map that would have more doubles its voxels and goes on. Default: 1,000,000, below 130 MB.
    pub most_points: usize,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { voxel_m: VOXEL_M, most_points: MOST_POINTS }
    }
}

impl MapOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        require_positive("voxel_m", self.voxel_m)?;
        // Points of eight voxels, each with some twenty normals 45° apart, must have room; numbers of points have 32 bits.
        let is_inside = |points| (1e3..=f64::from(u32::MAX)).contains(&points);
        Ok(require_option("most_points", self.most_points as f64, "1000 to 4294967295", is_inside)?)
    }
}
