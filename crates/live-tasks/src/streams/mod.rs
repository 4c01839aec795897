//! Streams that results go into.

mod mcap;
mod ply;
mod target;
mod trajectory;

pub use mcap::McapStream;
pub use ply::PlyStream;
pub use target::StreamTarget;
pub use trajectory::TrajectoryStream;

pub(crate) use target::Sink;
pub(crate) use trajectory::pose_numbers;
