//! Stations as clouds that can be registered.

pub(crate) mod placement;
pub mod refused;
pub(crate) mod station;
pub mod surface;

pub use placement::wrong_place;
pub use refused::Tried;
pub use station::{Station, Windows, projection};
pub use surface::{Start, Surface};
