//! Registration of organised frames: partners are found by projection, not by search.

mod aligner;
mod frame;
mod grid;
mod map;
mod nodes;
mod options;
mod pairs;
mod planes;
mod projection;
mod quality;
mod sums;
mod table;

pub use aligner::{FrameAligner, align_frames};
pub use frame::OrganisedFrame;
pub(crate) use map::{Agreement, thumbnail_difference};
pub use options::FrameAlignmentOptions;
pub use projection::Projection;
