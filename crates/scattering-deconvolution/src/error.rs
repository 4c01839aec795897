/// What can be wrong with a point spread function, an image or a restoration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter lies outside its domain.
    #[error("{name} = {value}: {expected}")]
    OutOfDomain {
        /// Name of the parameter.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A sampled kernel does not have `width * height` values.
    #[error("a kernel of {width} x {height} needs as many values, but {found} were given")]
    KernelLength {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Number of values given.
        found: usize,
    },
    /// The image is empty or larger than what can be transformed.
    #[error("an image of {width} x {height} pixels cannot be restored: it must have 1 to {limit} pixels")]
    ImageSize {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Largest number of pixels.
        limit: usize,
    },
    /// A plane does not have the size that the restorer or scatterer was made for.
    #[error("{what} has {found} values, expected {expected}")]
    PlaneLength {
        /// Which plane.
        what: &'static str,
        /// Pixels expected.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// Some spatial frequency is lost in scattering: `1 + H` vanishes there, and dividing by it blows noise up.
    #[error(
        "the point spread function cannot be undone: the smallest response |1 + H| is {response:e}, at least {limit} is needed, or a regularisation"
    )]
    Singular {
        /// Smallest modulus of `1 + H`.
        response: f64,
        /// What is needed without regularisation.
        limit: f64,
    },
    /// The iteration at the image border did not settle, or the values are too large for single precision.
    #[error("not converged after {iterations} iterations: relative residual {residual:e}, tolerance {tolerance:e}")]
    NotConverged {
        /// Iterations made.
        iterations: usize,
        /// Largest residual over the largest value of the image.
        residual: f64,
        /// What was asked for.
        tolerance: f64,
    },
    /// A ghost is late by a way in metres, which is a phase only at a modulation frequency.
    #[error(
        "a ghost with an extra path of {extra_path_m} m has no phase without a modulation: give the point spread function at one"
    )]
    ModulationNeeded {
        /// The extra way.
        extra_path_m: f64,
    },
    /// What was asked for exists only where all pixels scatter alike.
    #[error("{what} needs a point spread function that is the same for all pixels and without ghosts")]
    NotStationary {
        /// What was asked for.
        what: &'static str,
    },
    /// A capture from which a point spread function is to be estimated does not fit together.
    #[cfg(feature = "estimate")]
    #[error("capture: {reason}")]
    Capture {
        /// What is wrong.
        reason: String,
    },
    /// The adjustment of a point spread function failed in a way that says nothing about the captures.
    #[cfg(feature = "estimate")]
    #[error(transparent)]
    Adjustment(#[from] adjust::Error),
    /// The frame itself is inconsistent.
    #[error(transparent)]
    Frame(#[from] range_image::Error),
}

/// Result with this crate's [`Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
