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
    /// No pose of two clouds passed the verification.
    #[error(
        "no alignment found: {what} {found:.3}, at least {needed:.3} is needed ({correspondences} correspondences)"
    )]
    NoAlignment {
        /// What the best pose lacks.
        what: &'static str,
        /// What it has.
        found: f64,
        /// What it would need.
        needed: f64,
        /// Correspondences between the clouds.
        correspondences: usize,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Cloud(error) => error.is_misuse(),
            Self::Input(error) => error.is_misuse(),
            Self::NoAlignment { .. } => false,
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
