//! What goes wrong while the content of a file is read, before the file's name is added.

use std::io;
use std::path::Path;

use crate::Error;

/// The content is not what it should be, or the system could not deliver it.
#[derive(Debug)]
pub(crate) enum Fault {
    Content(String),
    System(io::Error),
}

impl Fault {
    /// For `map_err` behind a read that ends early: what that means.
    pub fn at(what: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |error| match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Content(what.to_owned()),
            _ => Self::from(error),
        }
    }

    pub fn of(self, file: &Path) -> Error {
        self.with(file, |reason| Error::format(file, reason))
    }

    /// As [`Self::of`], where more is known of what the content should be.
    pub fn with(self, file: &Path, content: impl FnOnce(String) -> Error) -> Error {
        match self {
            Self::Content(reason) => content(reason),
            Self::System(source) => Error::io(file, "read")(source),
        }
    }
}

impl From<String> for Fault {
    fn from(reason: String) -> Self {
        Self::Content(reason)
    }
}

impl From<&str> for Fault {
    fn from(reason: &str) -> Self {
        Self::Content(reason.to_owned())
    }
}

/// A decoder's complaint (an early end, a wrong checksum) is a fault of the content; the system's has a number.
impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        if error.raw_os_error().is_some() || error.kind() == io::ErrorKind::OutOfMemory {
            Self::System(error)
        } else {
            Self::Content(error.to_string())
        }
    }
}

/// An empty vector with room for `count` values, or the error of a machine without memory.
pub(crate) fn reserve<T>(count: usize) -> io::Result<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(count).map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    Ok(values)
}

/// As many zero bytes.
pub(crate) fn zeros(count: usize) -> io::Result<Vec<u8>> {
    let mut bytes = reserve(count)?;
    bytes.resize(count, 0);
    Ok(bytes)
}

/// The values of an iterator of known length.
pub(crate) fn collected<T>(values: impl ExactSizeIterator<Item = T>) -> io::Result<Vec<T>> {
    let mut out = reserve(values.len())?;
    out.extend(values);
    Ok(out)
}
