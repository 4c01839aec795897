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
    /// Too few source points have a partner in the target.
    #[error(
        "{found} of {of} source points have a partner within {max_distance_m} m in iteration {iteration}, \
         at least {needed} are needed: no overlap, or the guess is too far off"
    )]
    TooFewCorrespondences {
        /// Pairs found.
        found: usize,
        /// Source points tried.
        of: usize,
        /// Pairs needed.
        needed: usize,
        /// Limit of the distance at that moment, metre.
        max_distance_m: f64,
        /// Iteration, counted from 0.
        iteration: usize,
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
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Cloud(error) => error.is_misuse(),
            Self::Pose(error) => error.is_misuse(),
            _ => matches!(
                self,
                Self::NonFinite { .. }
                    | Self::NotPositive { .. }
                    | Self::LengthMismatch { .. }
                    | Self::InvalidOption { .. }
            ),
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
