//! Colours of one camera of a rig on the points of another: what it sees, and nothing of what is hidden from it.

mod depth_image;
mod inputs;
mod mountings;
mod paint;
mod run;
mod summary;

pub use mountings::read_mountings;
pub use paint::{Colouring, Unseen, colour_points};
pub use run::{ColourRequest, colour};
pub use summary::ColourSummary;
