/// What can go wrong, with the value that was wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A number is NaN, infinite or beyond what any unit measures (1e6).
    #[error("{what} {index} has a number that is not finite or beyond 1e6")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its number.
        index: usize,
    },
    /// Times do not ascend.
    #[error("{what} {index}: its time is not later than that before")]
    NotAscending {
        /// Which input.
        what: &'static str,
        /// Its number.
        index: usize,
    },
    /// There is no sample for too long, or none around the interval.
    #[error(
        "no inertial sample from {from_s} s on for {seconds} s, at most {allowed_s} s are bridged: check gaps, clocks and units of time"
    )]
    Gap {
        /// Beginning of the gap, second.
        from_s: f64,
        /// Its length, second.
        seconds: f64,
        /// What is allowed, second.
        allowed_s: f64,
    },
    /// Too few camera poses.
    #[error("{found} camera poses, at least {needed} are needed")]
    TooFewPoses {
        /// Poses given.
        found: usize,
        /// Poses needed.
        needed: usize,
    },
    /// An option that cannot be.
    #[error("{name} = {value}: {expected}")]
    InvalidOption {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A pose is no rigid pose, or its covariance is not symmetric and positive definite.
    #[error("camera pose {index}: {reason}")]
    InvalidPose {
        /// Its number.
        index: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A covariance of what a state learns is not symmetric and positive definite.
    #[error("the covariance of what is observed is not positive definite: check its numbers and units (metre, radian)")]
    InvalidCovariance,
    /// Samples that should be of a unit at rest are not.
    #[error(transparent)]
    Unrest(#[from] crate::rest::Unrest),
    /// The unit and the camera do not move alike.
    #[error(
        "the inertial unit contradicts the camera in {contradicting} of {intervals} intervals; \
         it turns by {angle_ratio:.3} times the camera's angles: check units (57.3: degrees), axes, mounting and clocks"
    )]
    Contradiction {
        /// Intervals that fail the test.
        contradicting: usize,
        /// All intervals.
        intervals: usize,
        /// Median ratio of the angles of unit and camera; NaN where the camera does not turn.
        angle_ratio: f64,
    },
    /// The adjustment failed.
    #[cfg(feature = "sequence")]
    #[error("inertial sequence: {0}")]
    Adjustment(#[from] adjust::Error),
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
