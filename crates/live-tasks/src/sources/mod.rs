//! Where frames come from.

mod folder;
mod recording;
mod stream;

use std::fmt;
use std::path::{Path, PathBuf};

use commands::{Error, Result};
use range_io::survey::Survey;

use crate::wire::{FrameError, LiveFrame};
use folder::FillingFolder;
use recording::Recording;
pub(crate) use recording::frame_time_s;

/// What a source has to give just now.
#[derive(Debug)]
pub enum Next {
    /// A frame.
    Frame(LiveFrame),
    /// A frame that can't be read, in words; others may follow.
    Unreadable(String),
    /// Nothing as yet: ask again.
    Waiting,
    /// No more frames will come.
    End,
}

/// A source of frames. A call waits for the source, a twentieth of a second at most where the source can be asked again.
pub trait FrameSource: Send {
    /// The next frame; the memory of `used`, an earlier one, may be used again.
    ///
    /// # Errors
    /// What the source can't be read further for.
    fn next(&mut self, used: Option<LiveFrame>) -> std::result::Result<Next, FrameError>;
}

/// A source as it is named on the command line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LiveSource {
    /// `-`: standard input.
    StandardInput,
    /// `tcp:HOST:PORT`: a server that sends frames as soon as one connects.
    Tcp(String),
    /// `unix:PATH`: the same at a socket of this machine.
    Unix(PathBuf),
    /// A folder: a recording where it has a `survey.ron`, else one that fills with files `*.frame`. A file or a named pipe: the
    /// frames in it.
    Path(PathBuf),
}

impl LiveSource {
    /// The source of a name.
    pub fn of_name(name: &str) -> Self {
        match (name, name.strip_prefix("tcp:"), name.strip_prefix("unix:")) {
            ("-", _, _) => Self::StandardInput,
            (_, Some(address), _) => Self::Tcp(address.to_owned()),
            (_, _, Some(path)) => Self::Unix(path.into()),
            _ => Self::Path(name.into()),
        }
    }

    /// The survey that is played, where it is one.
    pub fn recording(&self) -> Option<&Path> {
        let Self::Path(path) = self else { return None };
        let is_recording =
            path.file_name().is_some_and(|name| name == Survey::FILE_NAME) || path.join(Survey::FILE_NAME).exists();
        is_recording.then_some(path)
    }

    /// Opens it. `paced` says that a recording is played at its own speed.
    ///
    /// # Errors
    /// [`Error::Access`] where the system does not let us, [`Error::Request`] for a recording that can't be played.
    pub fn open(&self, paced: bool) -> Result<Box<dyn FrameSource>> {
        let fail = |source| Error::Access { path: self.to_string().into(), source };
        Ok(match self {
            Self::StandardInput => stream::frames(std::io::stdin()),
            Self::Tcp(address) => stream::frames(std::net::TcpStream::connect(address.as_str()).map_err(fail)?),
            #[cfg(unix)]
            Self::Unix(path) => stream::frames(std::os::unix::net::UnixStream::connect(path).map_err(fail)?),
            #[cfg(not(unix))]
            Self::Unix(_) => return Err(fail(std::io::ErrorKind::Unsupported.into())),
            Self::Path(path) if self.recording().is_some() => Box::new(Recording::open(path, paced)?),
            Self::Path(path) if path.is_dir() => Box::new(FillingFolder::new(path)),
            Self::Path(path) => stream::frames(std::fs::File::open(path).map_err(fail)?),
        })
    }
}

impl fmt::Display for LiveSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StandardInput => f.write_str("standard input"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Unix(path) => write!(f, "unix:{}", path.display()),
            Self::Path(path) => write!(f, "{}", path.display()),
        }
    }
}
