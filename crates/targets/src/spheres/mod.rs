//! Spheres in range images.

mod candidates;
mod find;
mod options;

pub use find::{SphereSighting, find_spheres};
pub use options::SphereOptions;
