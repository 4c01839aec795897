//! Frames of Analog Devices' time-of-flight cameras, as their viewer and SDK write them.
//!
//! The layout is that of the SDK's public structures `Metadata` (one head of 128 bytes a frame) and, for `.adcam`, of the head
//! that its recorder writes before the frames. What they call depth is the distance along the ray: the SDK multiplies it by
//! rays of length one.

mod frame;
mod header;
mod reader;

pub(crate) use frame::is_frame;
pub(crate) use header::is_header;
pub(crate) use reader::Adi;
