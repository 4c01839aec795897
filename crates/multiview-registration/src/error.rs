//! What can go wrong, with the value that was wrong.

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of a cloud, its neighbours or its normals.
    #[error(transparent)]
    Cloud(#[from] point_cloud::Error),
    /// Of a pose.
    #[error(transparent)]
    Pose(#[from] rigid_pose::Error),
    /// Of a pair of clouds.
    #[error(transparent)]
    Registration(#[from] icp_registration::Error),
    /// Of a pair of frames.
    #[error(transparent)]
    Frames(#[from] projective_registration::Error),
    /// Of an alignment without a guess.
    #[error(transparent)]
    Global(#[from] global_registration::Error),
    /// The simultaneous adjustment of the stations failed.
    #[error("adjustment of the stations: {0}")]
    Adjustment(String),
    /// There is nothing to work on.
    #[error("{what} is empty")]
    Empty {
        /// Which input.
        what: &'static str,
    },
    /// An option has a value outside its domain.
    #[error("option {name} is {value}; it must be {domain}")]
    InvalidOption {
        /// The option's field name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The values that are allowed.
        domain: &'static str,
    },
    /// Two inputs that belong together differ in length.
    #[error("{what} has {found} entries, {expected} were expected")]
    LengthMismatch {
        /// Which input.
        what: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries found.
        found: usize,
    },
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
    /// A coordinate, weight or sigma is NaN, infinite or beyond ±1e100.
    #[error("{what}: entry {index} is not a finite number below 1e100")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
    /// A weight or sigma is negative (or zero where that has no meaning).
    #[error("{what}: entry {index} is {value}, which must be positive")]
    NotPositive {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A linear system or an eigenvalue problem could not be solved.
    #[error("{what} could not be solved: {why}")]
    Numerical {
        /// Which system.
        what: &'static str,
        /// The reason.
        why: &'static str,
    },
    /// Fewer points than the task needs.
    #[error("{what}: {found} usable points, at least {needed} are needed")]
    TooFewPoints {
        /// Which input.
        what: &'static str,
        /// Points found.
        found: usize,
        /// Points needed.
        needed: usize,
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
            Self::Pose(error) => error.is_misuse(),
            Self::Registration(error) => error.is_misuse(),
            Self::Frames(error) => error.is_misuse(),
            Self::Global(error) => error.is_misuse(),
            _ => matches!(
                self,
                Self::NonFinite { .. }
                    | Self::NotPositive { .. }
                    | Self::NoSuchStation { .. }
                    | Self::LengthMismatch { .. }
                    | Self::InvalidOption { .. }
            ),
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
