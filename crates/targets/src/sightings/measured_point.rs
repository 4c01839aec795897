//! Where a target was seen in an image, and how well that is known.

use nalgebra::Matrix2;

/// The image point of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPoint {
    /// Pixel position `(col, row)`, 0-based, integers at pixel centres, lens distortion included.
    pub pixel: [f64; 2],
    /// Covariance of the position (col, row), square pixel, from the noise of the image.
    pub covariance: Matrix2<f64>,
}

/// A node of a board's grid that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NodePoint {
    /// Column and row of the node on the board, from 0.
    pub node: [usize; 2],
    /// Where it was seen.
    pub point: MeasuredPoint,
}

/// A board that was found in an image.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardSighting {
    /// The nodes that were seen, by row and column of the board. Hidden ones are missing.
    pub nodes: Vec<NodePoint>,
    /// Whether every node of the board was seen.
    pub complete: bool,
    /// How many labelings of the nodes the picture cannot tell apart: 1 is unique; 2 or 4 for a board that looks the same
    /// when it is turned. Node (0, 0) is then the one nearest to the upper left corner of the image.
    pub ambiguity: usize,
    /// Robust deviation of the nodes from a smooth map of the board onto the image, pixel, both coordinates together.
    pub residual_px: f64,
}
