//! What can go wrong, with the value that was wrong.

use rigid_pose::InputError;

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of a cloud, its neighbours or its normals.
    #[error(transparent)]
    Cloud(#[from] point_cloud::Error),
    /// Of an input, an option or a pose.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Two parts of a registration do not work together.
    #[error("{what} does not work with {with}")]
    Incompatible {
        /// The part.
        what: &'static str,
        /// What it was combined with.
        with: &'static str,
    },
    /// A part of a registration names a point that is not there.
    #[error("{part} names point {point}, but there are {count} (from 0)")]
    NoSuchPoint {
        /// The part.
        part: &'static str,
        /// The index.
        point: usize,
        /// Number of points.
        count: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("a triangle names vertex {vertex}, but there are {count} (from 0)")]
    NoSuchVertex {
        /// The index.
        vertex: usize,
        /// Number of vertices.
        count: usize,
    },
    /// Voxels of this size cannot be numbered in this cloud.
    #[error("voxels of {voxel_m} m in a cloud of {extent_m} m: the size must be positive, and above 1/2 000 000 of it")]
    VoxelSize {
        /// Edge of a voxel, metre.
        voxel_m: f64,
        /// Largest extent of the cloud along an axis, metre.
        extent_m: f64,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Cloud(error) => error.is_misuse(),
            Self::Input(error) => error.is_misuse(),
            Self::Incompatible { .. }
            | Self::NoSuchPoint { .. }
            | Self::NoSuchVertex { .. }
            | Self::VoxelSize { .. } => true,
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
