//! Where a stream of results goes.

use std::io::{BufWriter, ErrorKind, Result, Stdout, Write};
use std::path::PathBuf;

use atomic_output::FileWriter;
use commands::Error;

/// Where a stream of results goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StreamTarget {
    /// Standard output.
    StandardOutput,
    /// A file, which has its name when the stream has ended.
    File(PathBuf),
}

/// An opened target.
pub(crate) enum Sink {
    Output(BufWriter<Stdout>),
    File(FileWriter),
}

impl StreamTarget {
    pub(crate) fn open(&self) -> commands::Result<Sink> {
        Ok(match self {
            Self::StandardOutput => Sink::Output(BufWriter::new(std::io::stdout())),
            Self::File(file) => Sink::File(FileWriter::create(file)?),
        })
    }

    /// The file's name.
    pub(crate) fn file(&self) -> Option<&PathBuf> {
        match self {
            Self::File(file) => Some(file),
            Self::StandardOutput => None,
        }
    }

    /// What writing says: `None` where nobody reads any more.
    pub(crate) fn written<T>(&self, written: Result<T>) -> commands::Result<Option<T>> {
        match written {
            Ok(done) => Ok(Some(done)),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(None),
            Err(source) => {
                let path = self.file().cloned().unwrap_or_else(|| "standard output".into());
                Err(Error::Access { path, source })
            }
        }
    }
}

impl Sink {
    /// All is written: a file has its name from now on.
    pub(crate) fn commit(self) -> commands::Result<()> {
        match self {
            // A reader that has gone has read enough.
            Self::Output(mut output) => drop(output.flush()),
            Self::File(file) => file.commit()?,
        }
        Ok(())
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        match self {
            Self::Output(output) => output.write(bytes),
            Self::File(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> Result<()> {
        match self {
            Self::Output(output) => output.flush(),
            Self::File(file) => file.flush(),
        }
    }
}
