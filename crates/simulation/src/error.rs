use thiserror::Error;

/// What can be wrong with the description of a simulation, or with what is asked of it.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Error {
    /// The text is not RON, or not a simulation.
    #[error("line {line}, column {column}: {message}")]
    Parse {
        /// Line of the text, from 1.
        line: usize,
        /// Column of the text, from 1.
        column: usize,
        /// What the parser found and expected.
        message: String,
    },
    /// A field of the description has a value that it cannot have.
    #[error("{field} = {value}: {expected}")]
    Field {
        /// Path of the field, such as `scene.objects[3].shape.radius_m`.
        field: String,
        /// The value given.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// A station or a frame was asked for that the description does not have.
    #[error("{what} {index} was asked for, but there are {count}")]
    NoSuch {
        /// Station or frame.
        what: &'static str,
        /// Index asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A frame was asked for of a station that another simulator rendered.
    #[error("the station's image was rendered by another simulator")]
    ForeignImage,
    /// The camera is not valid.
    #[error("camera: {0}")]
    Camera(#[from] camera_model::Error),
    /// The range-error model is not valid, or has no observed range for a true one.
    #[error("range errors: {0}")]
    RangeError(#[from] error_models::Error),
    /// The point spread function is not valid.
    #[error("scattering: {0}")]
    Scattering(#[from] scattering_deconvolution::Error),
    /// A raster or frame error.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`Error`](enum@Error).
pub(crate) type Result<T> = std::result::Result<T, Error>;
