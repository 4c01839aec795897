use thiserror::Error;

/// What can be wrong with a range-error model or with a frame given to it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter of the model lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A frame error.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;
