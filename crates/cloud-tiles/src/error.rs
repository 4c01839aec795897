use std::path::{Path, PathBuf};

use thiserror::Error;

/// Why a cloud was not written in tiles.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A file that can't be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file that is no binary PLY of points.
    #[error("{}: {reason}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What was found, and what was expected.
        reason: String,
    },
    /// The tiles could not take their name.
    #[error(transparent)]
    Output(#[from] atomic_output::Error),
    /// Points so far apart that their coordinates, to a centimetre, are no 31-bit numbers.
    #[error("{}: the points extend over {extent_m} m, expected less than 21,000 km: units are probably not metres", path.display())]
    TooWide {
        /// The file.
        path: PathBuf,
        /// Their extent, metre.
        extent_m: f64,
    },
    /// A cloud without points at finite places.
    #[error("{}: none of its {points} points has finite coordinates", path.display())]
    NoPoints {
        /// The file.
        path: PathBuf,
        /// Its points.
        points: u64,
    },
    /// The cloud is another one than it was when it was read first.
    #[error("the cloud has changed while it was read")]
    Changed,
    /// An option outside its domain.
    #[error("{name} is {value}, expected {expected}")]
    OutOfDomain {
        /// The option.
        name: &'static str,
        /// Its value.
        value: u64,
        /// What it can be.
        expected: String,
    },
}

/// Result with this crate's [`Error`](enum@Error).
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Says which file the system would not read or write.
    pub(crate) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::Io { path: path.to_owned(), source }
    }

    pub(crate) fn format(path: &Path, reason: impl Into<String>) -> Self {
        Self::Format { path: path.to_owned(), reason: reason.into() }
    }
}
