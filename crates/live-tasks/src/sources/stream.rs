//! Frames of a pipe, a socket or a file.

use std::io::Read;

use super::{FrameSource, Next};
use crate::wire::{FrameError, FrameStream, LiveFrame};

/// A source of the frames that a reader gives.
pub(super) fn frames(reader: impl Read + Send + 'static) -> Box<dyn FrameSource> {
    Box::new(FrameStream::new(reader))
}

impl<R: Read + Send> FrameSource for FrameStream<R> {
    fn next(&mut self, used: Option<LiveFrame>) -> Result<Next, FrameError> {
        Ok(self.next_frame(used)?.map_or(Next::End, Next::Frame))
    }
}
