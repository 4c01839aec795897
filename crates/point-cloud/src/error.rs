//! What can go wrong, with the value that was wrong.

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is nothing to work on.
    #[error("{what} is empty")]
    Empty {
        /// Which input.
        what: &'static str,
    },
    /// A coordinate, weight or sigma is NaN, infinite or beyond ±1e100.
    #[error("{what}: entry {index} is not a finite number below 1e100")]
    NonFinite {
        /// Which input.
        what: &'static str,
        /// Its index, counted from 0.
        index: usize,
    },
    /// Many points lie at the origin, where cameras write points that they did not measure.
    #[error(
        "{what}: {found} of {of} points are (0, 0, 0), which cameras write where they measured nothing; leave them out"
    )]
    Unmeasured {
        /// Which input.
        what: &'static str,
        /// Points at the origin.
        found: usize,
        /// All points.
        of: usize,
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
    /// The search tree refused its points.
    #[error("the search tree could not be built: {0}")]
    Tree(String),
}

impl Error {
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
pub(crate) type Result<T> = std::result::Result<T, Error>;
