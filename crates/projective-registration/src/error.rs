//! What can go wrong, with the value that was wrong.

use rigid_pose::InputError;

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of a pair of clouds.
    #[error(transparent)]
    Registration(#[from] icp_registration::Error),
    /// Of an input, an option or a pose.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Of a cloud, its neighbours or its normals.
    #[error(transparent)]
    Cloud(#[from] point_cloud::Error),
    /// A ray of a camera leads backwards, or coincides with or crosses its neighbour.
    #[error("ray {index}: {why}")]
    DegenerateRay {
        /// Index of the pixel, row by row.
        index: usize,
        /// What is wrong.
        why: &'static str,
    },
    /// Most points of a frame do not lie on the rays of their pixels.
    #[error("most points lie beside the rays of their pixels, among them point {index}: another camera or frame?")]
    PointsOffRays {
        /// Index of such a point, row by row.
        index: usize,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Registration(error) => error.is_misuse(),
            Self::Cloud(error) => error.is_misuse(),
            Self::Input(error) => error.is_misuse(),
            Self::DegenerateRay { .. } | Self::PointsOffRays { .. } => true,
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
