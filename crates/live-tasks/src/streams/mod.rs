//! Streams that results go into.

mod mcap;
mod ply;
mod target;

pub use mcap::McapStream;
pub use ply::PlyStream;
pub use target::StreamTarget;

pub(crate) use target::Sink;
