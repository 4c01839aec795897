//! Registration of organised frames: partners are found by projection `[Blais1995]`, not by search.
//!
//! A frame is reduced to nodes (averages of inverse depth over squares of pixels), planes are laid through them, and
//! the distances of the source's nodes from the target's planes are minimised, level by level.

mod aligner;
mod apart;
mod blocks;
mod consistency;
#[cfg(test)]
mod drawn;
mod frame;
mod grid;
mod map;
mod nodes;
mod options;
mod outlines;
mod pairs;
mod places;
mod planes;
mod projection;
mod quality;
mod search;
mod shared_error;
mod shared_planes;
mod starts;
mod sums;
mod table;
mod track;

pub use aligner::{FrameAligner, align_frames};
pub use consistency::{FrameConsistency, frame_consistency};
pub use frame::OrganisedFrame;
pub(crate) use map::{Agreement, thumbnail_difference};
pub use options::FrameAlignmentOptions;
pub use projection::Projection;
pub use shared_error::SharedError;
pub(crate) use shared_error::{ByField, COEFFICIENTS, Field, FieldMatrix, Influence};
