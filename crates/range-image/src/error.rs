/// What can be wrong with a frame or with the options of a stage that works on it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A plane's data does not have `width * height` elements.
    #[error("a raster of {width} x {height} pixels needs {expected} values, but {found} were given")]
    RasterLength {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// `width * height`.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
    /// Two planes that belong together differ in size.
    #[error("{what} is {found_width} x {found_height} pixels, expected {width} x {height}")]
    SizeMismatch {
        /// Which plane.
        what: &'static str,
        /// Expected columns.
        width: usize,
        /// Expected rows.
        height: usize,
        /// Columns found.
        found_width: usize,
        /// Rows found.
        found_height: usize,
    },
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
    /// An operation over several frames got none.
    #[error("{what}: no frame was given")]
    NoFrames {
        /// The operation.
        what: &'static str,
    },
    /// The frames of a set do not belong together.
    #[error("frame {index}: {what} differs from that of the first frame")]
    Inconsistent {
        /// Position of the frame in the set.
        index: usize,
        /// What differs.
        what: &'static str,
    },
}

/// Result with this crate's [`Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;
