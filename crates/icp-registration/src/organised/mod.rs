//! Registration of organised frames: partners are found by projection, not by search.

mod aligner;
mod frame;
mod grid;
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
pub use options::FrameAlignmentOptions;
pub use projection::Projection;
