//! An image point outside the image.

use thiserror::Error;

/// An image point that lies outside the image.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{what}: {component} = {value} lies outside the image ({image}), expected {} to {}", .limits[0], .limits[1])]
#[non_exhaustive]
pub struct OutsideImage {
    /// Target and station by name.
    pub what: String,
    /// Position of the sighting in the network.
    pub sighting: usize,
    /// `col` or `row`.
    pub component: &'static str,
    /// The value, pixel.
    pub value: f64,
    /// Smallest and largest value, pixel: the edges of the image.
    pub limits: [f64; 2],
    /// Size of the image in words, and what all image points together look like.
    pub image: String,
}
