//! Point clouds as PLY: written binary little-endian block by block, read in all three encodings.
//!
//! Properties that are written and recognised: `x y z`, `nx ny nz`, `intensity`, `sigma`, `flags`, `frame` and the six
//! covariance terms `cov_xx cov_xy cov_xz cov_yy cov_yz cov_zz`. A prefix `scalar_` and capitals, as other programs write
//! them, are read too; other properties of the vertices, and other elements, are left alone.

mod header;
mod read;
mod write;

pub use read::read_cloud;
pub use write::{PlyWriter, Precision, write_cloud};

/// A point cloud as a file holds it; each attribute there is has one value a point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CloudFile {
    /// Positions in metres.
    pub points: Vec<[f64; 3]>,
    /// Unit normals.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Amplitude in the camera's unit.
    pub intensity: Option<Vec<f32>>,
    /// Standard deviation along the ray in metres.
    pub sigma: Option<Vec<f32>>,
    /// Bits of [`range_image::Flags`](https://docs.rs/range-image).
    pub flags: Option<Vec<u16>>,
    /// Frame each point comes from.
    pub frame: Option<Vec<u32>>,
    /// Covariance in square metres: xx, xy, xz, yy, yz, zz.
    pub covariance: Option<Vec<[f32; 6]>>,
}

const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COVARIANCE: [&str; 6] = ["cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"];

impl CloudFile {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Names of the attributes that are there with their lengths.
    fn attributes(&self) -> Vec<(&'static str, usize)> {
        let lengths = [
            ("normals", self.normals.as_ref().map(Vec::len)),
            ("intensity", self.intensity.as_ref().map(Vec::len)),
            ("sigma", self.sigma.as_ref().map(Vec::len)),
            ("flags", self.flags.as_ref().map(Vec::len)),
            ("frame", self.frame.as_ref().map(Vec::len)),
            ("covariance", self.covariance.as_ref().map(Vec::len)),
        ];
        lengths.into_iter().filter_map(|(name, length)| Some((name, length?))).collect()
    }
}
