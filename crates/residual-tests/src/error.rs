use thiserror::Error;

/// Why residuals or calibrations could not be tested.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// An argument or option lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the argument.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// There are too few residuals to test.
    #[error("{residuals} residuals, {needed} are needed")]
    TooFewResiduals {
        /// Number of residuals.
        residuals: usize,
        /// Number needed.
        needed: usize,
    },
    /// Two parameters of a calibration have one name.
    #[error("two {kind}s are called `{name}`")]
    DuplicateName {
        /// What has the name.
        kind: &'static str,
        /// Name.
        name: String,
    },
    /// The two sides cannot be compared.
    #[error("{comparison}: {needs}")]
    NotComparable {
        /// Which comparison.
        comparison: &'static str,
        /// What is missing.
        needs: String,
    },
    /// A model of the drift or of the ranges is not valid.
    #[error(transparent)]
    Model(#[from] error_models::Error),
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
