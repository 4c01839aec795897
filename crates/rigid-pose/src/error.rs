//! What can go wrong, with the value that was wrong.

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
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
    /// The points lie on one line (or in one place): the rotation about it is not determined.
    #[error("{what}: the points are collinear (second to first extent {ratio:.1e})")]
    Collinear {
        /// Which input.
        what: &'static str,
        /// Second principal extent divided by the first.
        ratio: f64,
    },
    /// Two different rotations fit the point pairs equally well.
    #[error("the rotation is ambiguous: the best two solutions differ by {gap:.1e} of the criterion")]
    AmbiguousRotation {
        /// Relative gap between the two largest eigenvalues.
        gap: f64,
    },
    /// A linear system or an eigenvalue problem could not be solved.
    #[error("{what} could not be solved: {why}")]
    Numerical {
        /// Which system.
        what: &'static str,
        /// The reason.
        why: &'static str,
    },
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        matches!(self, Self::NonFinite { .. } | Self::NotPositive { .. } | Self::LengthMismatch { .. })
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
