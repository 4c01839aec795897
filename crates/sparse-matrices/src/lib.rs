#![doc = include_str!("../README.md")]

mod factor;
mod inverse;
mod matrix;
mod order;

pub use factor::BlockFactor;
pub use inverse::{BlockInverse, SelectedInverse};
pub use matrix::BlockMatrix;
pub use nalgebra;
