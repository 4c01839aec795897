use thiserror::Error;

/// Why a figure could not be drawn.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A picture that could not be packed.
    #[error("report: figure {figure}: {source}")]
    Picture {
        /// The figure's title.
        figure: String,
        /// Why.
        source: png::EncodingError,
    },
}

/// Result with this crate's [`Error`](enum@Error).
pub(crate) type Result<T> = std::result::Result<T, Error>;
