use thiserror::Error;

use crate::PrimitiveKind;

/// Why no primitive was fitted, or no reference range found.
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
    /// The plane is not in front of the camera at this pixel.
    #[error("the ray of pixel ({col}, {row}) does not meet the plane in front of the camera")]
    PlaneNotSeen {
        /// Column.
        col: f64,
        /// Row.
        row: f64,
    },
    /// A region has too few usable pixels.
    #[error("{pixels} usable pixels for a {kind}, {needed} are needed")]
    TooFewPixels {
        /// The primitive.
        kind: PrimitiveKind,
        /// Pixels there are.
        pixels: usize,
        /// Pixels needed.
        needed: usize,
    },
    /// A region shows something else.
    #[error("the region is no {kind}: {what} {found:.2}, at most {limit:.2} is accepted")]
    NotThatPrimitive {
        /// The primitive.
        kind: PrimitiveKind,
        /// What tells.
        what: &'static str,
        /// Its value.
        found: f64,
        /// Largest accepted.
        limit: f64,
    },
    /// A region is too small a part of a primitive.
    #[error(
        "the region is too small a part of a {kind}: the deviation of the {what} is {sigma:.3}, at most {limit:.3} is accepted"
    )]
    PrimitiveNotDetermined {
        /// The primitive.
        kind: PrimitiveKind,
        /// What is open.
        what: &'static str,
        /// Its standard deviation.
        sigma: f64,
        /// Largest accepted.
        limit: f64,
    },
    /// The adjustment failed.
    #[error(transparent)]
    Adjust(#[from] adjust::Error),
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] camera_model::Error),
    /// The frame is not valid.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`enum@Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
