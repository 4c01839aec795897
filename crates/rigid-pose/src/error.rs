//! What can go wrong, with the value that was wrong.

/// What is wrong with an input or an option, or what there is too little of: the error of this crate, and of inputs of the
/// crates that register with poses.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
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

impl InputError {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        matches!(
            self,
            Self::NonFinite { .. }
                | Self::NotPositive { .. }
                | Self::LengthMismatch { .. }
                | Self::InvalidOption { .. }
        )
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, InputError>;
