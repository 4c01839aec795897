use crate::error::Result;
use rigid_pose::{require_option, require_positive};

/// How fine a [`SurfaceMap`](crate::SurfaceMap) is, and how large it may become.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapOptions {
    /// Edge of a voxel, metre. Smaller, and shapes are kept finer, in more points, each averaged over less. Default: 0.05, that of crate
    /// `fusion`.
    pub voxel_m: f64,
    /// Most points. A map that would have more doubles its voxels and goes on. Default: 1,000,000 of some 130 bytes each: below 130 MB, and
    /// 2,500 m² of walls in voxels of 0.05 m.
    pub most_points: usize,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { voxel_m: 0.05, most_points: 1_000_000 }
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
