use thiserror::Error;

/// Why a matrix has no decomposition.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The iteration did not converge, or an element is not finite.
    #[error("the {what} did not converge")]
    Decomposition {
        /// Which decomposition.
        what: &'static str,
    },
}

/// Result with this crate's [`enum@Error`].
pub type Result<T> = std::result::Result<T, Error>;
