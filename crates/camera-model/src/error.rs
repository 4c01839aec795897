/// What can be wrong with a camera, or with a point or pixel given to it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter of the camera, or a value given to it, lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// The point does not lie in front of the camera, which looks along -z.
    #[error("the point lies behind the camera: its z in the camera frame is {z_m} m, in front it is negative")]
    BehindCamera {
        /// The point's z in the camera frame, metre.
        z_m: f64,
    },
    /// No observed image point belongs to a corrected one: the lens model folds over before it is reached.
    #[error(
        "no observed image point belongs to the corrected image point ({x_mm}, {y_mm}) mm: \
         the lens model folds over before it"
    )]
    NoObservedPoint {
        /// Corrected image point, millimetre.
        x_mm: f64,
        /// Corrected image point, millimetre.
        y_mm: f64,
    },
    /// The lens model folds over inside the image: several pixels would look along one ray.
    #[error("the lens model folds over inside the image, before pixel ({col}, {row}): its coefficients are not usable")]
    FoldInsideImage {
        /// Column of the first pixel found beyond the fold.
        col: usize,
        /// Row of the first pixel found beyond the fold.
        row: usize,
    },
    /// A `plumb_bob` model folds over inside its image: no ray belongs to a pixel position.
    #[cfg(feature = "convert")]
    #[error("the plumb_bob model folds over inside its image: no ray belongs to pixel ({col}, {row})")]
    PlumbBobFold {
        /// Column.
        col: f64,
        /// Row.
        row: f64,
    },
    /// A rational model folds over inside its image: no ray belongs to a pixel position.
    #[cfg(feature = "convert")]
    #[error("the rational lens model folds over inside its image: no ray belongs to pixel ({col}, {row})")]
    RationalFold {
        /// Column.
        col: f64,
        /// Row.
        row: f64,
    },
    /// The fit of one lens model to another failed.
    #[cfg(feature = "convert")]
    #[error("fitting one lens model to another: {0}")]
    Fit(#[from] adjust::Error),
    /// A frame or format error.
    #[error(transparent)]
    Image(#[from] range_image::Error),
}

/// Result with this crate's [`Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
