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
    /// The slice holds fewer elements than the matrix has.
    #[error("a matrix of order {n} has {n} x {n} elements, the slice holds {found}")]
    TooShort {
        /// Order asked for.
        n: usize,
        /// Elements given.
        found: usize,
    },
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
