//! Counts of a stream of frames that are carried from frame to frame, and solved by the tree only where they do not hold.

mod attach;
mod coarse;
mod compare;
mod options;
mod pixels;
mod unwrapper;

pub use options::{CarryOptions, CarrySummary, WholeFrame};
pub use unwrapper::CarriedUnwrapper;
