//! Stations as clouds that can be registered.

pub(crate) mod at_once;
pub(crate) mod placement;
pub mod refused;
pub(crate) mod station;
pub mod surface;

pub use at_once::{poses_in, register_at_once};
pub use placement::wrong_place;
pub use refused::Tried;
pub use station::{Station, Windows, projection};
pub use surface::{Start, Surface};
