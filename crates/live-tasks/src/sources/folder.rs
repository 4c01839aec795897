//! A folder that fills with frames.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::{FrameSource, Next};
use crate::wire::{FrameError, FrameStream, LiveFrame};

/// Ending of a frame's file.
const ENDING: &str = "frame";
/// Name of the file that says that no more will come.
const END: &str = "end";
/// Time between two looks into the folder: a third of a frame at 30 Hz.
const PAUSE: Duration = Duration::from_millis(10);

/// Takes files in the order of their names; what comes later under an earlier name is left alone.
pub(super) struct FillingFolder {
    folder: PathBuf,
    last: Option<OsString>,
    waiting: VecDeque<OsString>,
}

impl FillingFolder {
    pub(super) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), last: None, waiting: VecDeque::new() }
    }

    /// Looks for files behind the last; whether the folder is complete.
    fn look(&mut self) -> std::io::Result<bool> {
        let mut complete = false;
        let mut names = Vec::new();
        for entry in std::fs::read_dir(&self.folder)? {
            let name = entry?.file_name();
            complete |= name == END;
            let is_frame = Path::new(&name).extension().is_some_and(|ending| ending == ENDING);
            if is_frame && self.last.as_ref().is_none_or(|last| name > *last) {
                names.push(name);
            }
        }
        names.sort_unstable();
        self.waiting.extend(names);
        Ok(complete)
    }

    fn read(&self, name: &OsString, used: Option<LiveFrame>) -> Result<LiveFrame, String> {
        let path = self.folder.join(name);
        let say = |words: &dyn std::fmt::Display| format!("{}: {words}", path.display());
        let (file, _) = range_io::open(&path).map_err(|error| error.to_string())?;
        let mut stream = FrameStream::new(file);
        let frame = stream.next_frame(used).map_err(|error| say(&error))?.ok_or_else(|| say(&"is empty"))?;
        stream.require_end().map_err(|error| say(&error))?;
        Ok(frame)
    }
}

impl FrameSource for FillingFolder {
    fn next(&mut self, used: Option<LiveFrame>) -> Result<Next, FrameError> {
        if self.waiting.is_empty() {
            let complete = self.look().map_err(|source| FrameError::Read { position: 0, source })?;
            if self.waiting.is_empty() {
                if complete {
                    return Ok(Next::End);
                }
                std::thread::sleep(PAUSE);
                return Ok(Next::Waiting);
            }
        }
        let Some(name) = self.waiting.pop_front() else { return Ok(Next::Waiting) };
        let read = self.read(&name, used);
        self.last = Some(name);
        Ok(read.map_or_else(Next::Unreadable, Next::Frame))
    }
}
