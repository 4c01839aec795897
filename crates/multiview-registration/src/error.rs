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
    /// Of a pair of clouds.
    #[error(transparent)]
    Registration(#[from] icp_registration::Error),
    /// Of a pair of frames.
    #[error(transparent)]
    Frames(#[from] projective_registration::Error),
    /// Of an alignment without a guess.
    #[error(transparent)]
    Global(#[from] global_registration::Error),
    /// More stations than registration has been shown to bring into their places.
    #[error("{found} stations: at most {most} are registered at once from {start}; {remedy}")]
    TooManyStations {
        /// Stations found.
        found: usize,
        /// Stations that are allowed.
        most: usize,
        /// What was known of them.
        start: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A pair names a station that is not there.
    #[error("a pair names station {station}, but there are {count} (from 0)")]
    NoSuchStation {
        /// The index.
        station: usize,
        /// Number of stations.
        count: usize,
    },
    /// No alignment that holds leads to some stations.
    #[error("nothing connects stations {stations:?} to station {to} ({})", .reasons.join("; "))]
    UnconnectedStations {
        /// The stations that are left alone.
        stations: Vec<usize>,
        /// A station of the part that holds together.
        to: usize,
        /// Why, one for each of these stations.
        reasons: Vec<String>,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Cloud(error) => error.is_misuse(),
            Self::Input(error) => error.is_misuse(),
            Self::Registration(error) => error.is_misuse(),
            Self::Frames(error) => error.is_misuse(),
            Self::Global(error) => error.is_misuse(),
            Self::NoSuchStation { .. } => true,
            Self::TooManyStations { .. } | Self::UnconnectedStations { .. } => false,
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
