//! What can go wrong, with the value that was wrong.

use rigid_pose::InputError;

/// Every error of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Of an input or an option.
    #[error(transparent)]
    Input(#[from] InputError),
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
    /// The search tree refused its points.
    #[error("the search tree could not be built: {0}")]
    Tree(String),
}

impl Error {
    /// Whether the input or an option is wrong; otherwise the data do not show what was asked for.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        match self {
            Self::Input(error) => error.is_misuse(),
            Self::Unmeasured { .. } | Self::Tree(_) => false,
        }
    }
}

/// Result of this crate.
pub(crate) type Result<T> = std::result::Result<T, Error>;
