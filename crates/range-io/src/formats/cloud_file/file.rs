use nalgebra::Isometry3;

use crate::{Error, Result};

/// A point cloud as a file holds it; each attribute there is has one value a point.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CloudFile {
    /// Positions in metres; NaN where an organised cloud has no point.
    pub points: Vec<[f64; 3]>,
    /// Unit normals.
    pub normals: Option<Vec<[f32; 3]>>,
    /// Amplitude in the camera's unit.
    pub intensity: Option<Vec<f32>>,
    /// Standard deviation along the ray in metres.
    pub sigma: Option<Vec<f32>>,
    /// The part of it in metres that is the point's own: without what many points have in common. Written, and not read.
    pub sigma_own: Option<Vec<f32>>,
    /// Bits of [`range_image::Flags`](https://docs.rs/range-image).
    pub flags: Option<Vec<u16>>,
    /// Frame each point comes from.
    pub frame: Option<Vec<u32>>,
    /// Covariance in square metres: xx, xy, xz, yy, yz, zz.
    pub covariance: Option<Vec<[f32; 6]>>,
    /// Red, green and blue; written as PLY and PCD, and not read.
    pub colours: Option<Vec<[u8; 3]>>,
    /// Columns and rows of an organised cloud, whose points stand row by row from the upper left.
    pub size: Option<[usize; 2]>,
    /// Pose that the file states for its points; they stay as they are, in the frame of the sensor.
    pub world_from_cloud: Option<Isometry3<f64>>,
}

/// Type that positions are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// `float`: right to 0.1 micrometre at 1 m, to 8 micrometres at 100 m.
    #[default]
    Single,
    /// `double`: all digits. As PCD only for readers that take them: PCL's own point types and Open3D's classic reader
    /// want `float` and give zeros or nothing.
    Double,
}

pub(crate) const POSITION: [&str; 3] = ["x", "y", "z"];
pub(crate) const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
pub(crate) const COVARIANCE: [&str; 6] = ["cov_xx", "cov_xy", "cov_xz", "cov_yy", "cov_yz", "cov_zz"];

impl CloudFile {
    /// Number of points, those that are NaN included.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The points and normals in the frame that the file's pose leads to; the pose is gone then. Standard deviations
    /// along the ray need no turn, a covariance gets one.
    #[must_use]
    pub fn in_world(mut self) -> Self {
        let Some(pose) = self.world_from_cloud.take() else { return self };
        for point in &mut self.points {
            *point = (pose * nalgebra::Point3::from(*point)).coords.into();
        }
        for normal in self.normals.iter_mut().flatten() {
            let turned = pose.rotation * nalgebra::Vector3::from(normal.map(f64::from));
            *normal = [turned.x as f32, turned.y as f32, turned.z as f32];
        }
        let turn = pose.rotation.to_rotation_matrix();
        for terms in self.covariance.iter_mut().flatten() {
            let [xx, xy, xz, yy, yz, zz] = terms.map(f64::from);
            let before = nalgebra::Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            let m = turn.matrix() * before * turn.matrix().transpose();
            *terms = [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33].map(|term| term as f32);
        }
        self
    }

    /// Names of the attributes that are there with their lengths.
    pub(crate) fn attributes(&self) -> Vec<(&'static str, usize)> {
        let lengths = [
            ("normals", self.normals.as_ref().map(Vec::len)),
            ("intensity", self.intensity.as_ref().map(Vec::len)),
            ("sigma", self.sigma.as_ref().map(Vec::len)),
            ("sigma_own", self.sigma_own.as_ref().map(Vec::len)),
            ("flags", self.flags.as_ref().map(Vec::len)),
            ("frame", self.frame.as_ref().map(Vec::len)),
            ("covariance", self.covariance.as_ref().map(Vec::len)),
            ("colours", self.colours.as_ref().map(Vec::len)),
        ];
        lengths.into_iter().filter_map(|(name, length)| Some((name, length?))).collect()
    }

    /// Refuses attributes of another length than the points.
    pub(crate) fn check_lengths(&self) -> Result<()> {
        match self.attributes().iter().find(|(_, length)| *length != self.len()) {
            Some((name, length)) => Err(value_error(name, format!("has {length} values for {} points", self.len()))),
            None => Ok(()),
        }
    }

    /// Refuses an image size that is not that of the points.
    pub(crate) fn check_size(&self) -> Result<()> {
        match self.size {
            Some([width, height]) if width.checked_mul(height) != Some(self.len()) => {
                Err(value_error("size", format!("is {width} x {height} for {} points", self.len())))
            }
            _ => Ok(()),
        }
    }
}

/// A cloud in memory that cannot be written.
pub(crate) fn value_error(field: &str, reason: String) -> Error {
    Error::Value { what: "cloud", field: field.to_owned(), reason }
}
