//! What can go wrong, with the value that was wrong.

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of a pose.
    #[error(transparent)]
    Pose(#[from] rigid_pose::Error),
    /// Of a pair of frames.
    #[error(transparent)]
    Frames(#[from] projective_registration::Error),
    /// Of an alignment without a guess.
    #[error(transparent)]
    Global(#[from] global_registration::Error),
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
    /// Of an inertial unit.
    #[error(transparent)]
    Inertial(#[from] inertial::Error),
    /// Two trajectories have no pose at the same time.
    #[error(
        "no pose of the estimate ({:.3} s to {:.3} s) has one of the truth ({:.3} s to {:.3} s) within {tolerance_s} s",
        .estimate_s[0], .estimate_s[1], .truth_s[0], .truth_s[1]
    )]
    NoCommonTime {
        /// Largest difference of the times, second.
        tolerance_s: f64,
        /// First and last time of the estimate.
        estimate_s: [f64; 2],
        /// First and last time of the truth.
        truth_s: [f64; 2],
    },
    /// A coordinate, weight or sigma is NaN, infinite or beyond ±1e100.
    #[error("{what}: entry {index} is not a finite number below 1e100")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
    /// Times do not ascend.
    #[error("{what} do not ascend at entry {index}")]
    NotAscending {
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
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Pose(error) => error.is_misuse(),
            Self::Frames(error) => error.is_misuse(),
            Self::Global(error) => error.is_misuse(),
            _ => matches!(
                self,
                Self::NonFinite { .. }
                    | Self::NotAscending { .. }
                    | Self::LengthMismatch { .. }
                    | Self::InvalidOption { .. }
            ),
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
