#![doc = include_str!("../README.md")]

mod adjustment;
mod graph;
mod relation;

pub use graph::is_likely;
pub use graph::{Edge, Graph};
pub use nalgebra;
pub use projective_registration;
pub use relation::Relation;
pub use rigid_pose;
