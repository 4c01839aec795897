use thiserror::Error;

use crate::{Contradiction, NetworkError};

/// Why a calibration gave no trustworthy result.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The network, or its adjustment.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// A list of terms names two that stand for the same.
    #[error("the list of terms names `{first}` and `{second}`: {reason}; keep one of them")]
    ConflictingTerms {
        /// One of them.
        first: String,
        /// The other.
        second: String,
        /// Why they exclude each other.
        reason: &'static str,
    },
    /// The method asks for something that the network does not have.
    #[error("method {method}: {needs}")]
    MethodNeeds {
        /// Method.
        method: String,
        /// What is missing.
        needs: String,
    },
    /// The observations of a network contradict each other.
    #[error("{0}")]
    Contradiction(Box<Contradiction>),
    /// Start values of a hyperbola.
    #[error(transparent)]
    Ranges(#[from] range_calibration::Error),
}

impl Error {
    /// Whether an adjustment failed as it does where observations contradict each other.
    pub(crate) fn is_without_end(&self) -> bool {
        matches!(self, Self::Network(error) if error.is_without_end())
    }
}

impl From<adjust::Error> for Error {
    fn from(error: adjust::Error) -> Self {
        Self::Network(error.into())
    }
}

impl From<error_models::Error> for Error {
    fn from(error: error_models::Error) -> Self {
        Self::Network(error.into())
    }
}

pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;
