//! Corners by maximum likelihood: two blurred edges that cross, fitted to the values of the pixels.

mod covered;
mod crossing;
mod fit;
pub(crate) mod refine;
mod window;
