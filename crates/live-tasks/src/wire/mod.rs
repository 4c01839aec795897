//! The frames that come through a pipe, a socket or a folder: one header of 64 bytes and the samples behind it.

mod error;
mod header;
mod stream;
mod write;

pub use error::FrameError;
pub use header::{FrameHeader, SampleType};
pub use stream::{FrameStream, LiveFrame};
pub use write::write_live_frame;
