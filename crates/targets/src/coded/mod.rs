//! Coded rings: a disc whose number stands in a ring about it.

mod codes;
mod decode;
mod find;
mod model;

pub use codes::{Code, codes};
pub use find::{CodedOptions, CodedSighting, find_coded};
/// Radii of the code's ring in parts of the disc's radius: inner, outer.
pub(crate) const RING: [f64; 2] = [2.0, 3.0];
/// Radius of the ground about it that must be free, in parts of the disc's radius.
pub(crate) const GROUND: f64 = 4.0;
