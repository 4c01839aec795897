/// Why the common errors of a survey could not be told.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or its text.
    #[error(transparent)]
    Io(#[from] range_io::Error),
    /// Numbers that are no covariance, or columns that are not there.
    #[error("the common errors: {0}")]
    Errors(#[from] point_uncertainty::Error),
    /// The stations could not be registered again to see how their poses follow the calibration.
    #[error("how the poses follow the calibration cannot be told: {0}")]
    Registration(#[from] multiview_registration::Error),
    /// Errors of the calibration that the registration leaves without a covariance.
    #[error(
        "the errors of the calibration have no covariance beside the poses: two of them are one; hold one in the calibration"
    )]
    Calibration,
    /// A range model that is none.
    #[error("the calibration's range terms are no model: {0}")]
    Model(String),
}

pub(crate) type Result<T> = std::result::Result<T, Error>;
