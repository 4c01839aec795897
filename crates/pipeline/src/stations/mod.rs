//! Stations as clouds that can be registered.

pub(crate) mod at_once;
pub(crate) mod placement;
pub mod refused;
pub(crate) mod station;
pub mod surface;

pub use at_once::{MOST_TRIED, poses_in, register_as_frames, register_at_once};
pub use placement::{not_placed, unchecked, wrong_place};
pub use refused::Tried;
pub use station::{Station, Windows, projection};
pub use surface::{Start, Surface};
