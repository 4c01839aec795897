//! What can go wrong, with the value that was wrong.

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of a pair of clouds.
    #[error(transparent)]
    Registration(#[from] icp_registration::Error),
    /// Of a pose.
    #[error(transparent)]
    Pose(#[from] rigid_pose::Error),
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
    /// A coordinate, weight or sigma is NaN, infinite or beyond ±1e100.
    #[error("{what}: entry {index} is not a finite number below 1e100")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
    /// A linear system or an eigenvalue problem could not be solved.
    #[error("{what} could not be solved: {why}")]
    Numerical {
        /// Which system.
        what: &'static str,
        /// The reason.
        why: &'static str,
    },
    /// Most points of a frame do not lie on the rays of their pixels.
    #[error("most points lie beside the rays of their pixels, among them point {index}: another camera or frame?")]
    PointsOffRays {
        /// Index of such a point, row by row.
        index: usize,
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
            Self::Registration(error) => error.is_misuse(),
            Self::Pose(error) => error.is_misuse(),
            Self::Cloud(error) => error.is_misuse(),
            _ => matches!(
                self,
                Self::NonFinite { .. }
                    | Self::LengthMismatch { .. }
                    | Self::InvalidOption { .. }
                    | Self::DegenerateRay { .. }
                    | Self::PointsOffRays { .. }
            ),
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
