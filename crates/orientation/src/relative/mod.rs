//! Orientation of views to each other, from image points (and ranges) of the same targets, whose coordinates nobody knows.

mod bundle;
mod candidates;
mod consensus;
mod epipolar;
mod five_points;
mod minima;
mod network;
mod network_start;
mod rays;
mod rotation_only;
mod two_views;

pub use bundle::{ObjectPoint, TieObservation};
pub(crate) use candidates::samples;
pub(crate) use network::minima;
pub use network::{NetworkOptions, NetworkScale, ObservedPart, OrientedNetwork, OrientedStation, orient_network};
pub use rays::ImagePoint;
pub use two_views::{RelativeOrientation, RelativeOrientationOptions, orient_two_views};
