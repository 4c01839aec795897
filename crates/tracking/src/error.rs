//! What can go wrong, with the value that was wrong.

use rigid_pose::InputError;

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of an input, an option or a pose.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Of a pair of frames.
    #[error(transparent)]
    Frames(#[from] projective_registration::Error),
    /// Of an alignment without a guess.
    #[error(transparent)]
    Global(#[from] global_registration::Error),
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
    /// Times do not ascend.
    #[error("{what} do not ascend at entry {index}")]
    NotAscending {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Input(error) => error.is_misuse(),
            Self::Frames(error) => error.is_misuse(),
            Self::Global(error) => error.is_misuse(),
            Self::NotAscending { .. } => true,
            Self::Inertial(_) | Self::NoCommonTime { .. } => false,
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
