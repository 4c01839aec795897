//! The error that all frames of a sensor share.

use std::ops::Range;

use camera_model::ImageFormat;

/// Intervals of the grid along the longer side of the image. What a Kinect bends alike in all frames is half alike at 32 pixels of its
/// 640. More intervals follow finer patterns and cost the cube of their number; fewer leave more of the pattern in the points.
const INTERVALS: usize = 20;

/// Columns of the error that all frames of a sensor share, as values of inverse depth (1/metre) at the nodes of a grid over the image,
/// bilinear between them.
///
/// Depth cameras that find depths from a pattern or from two images err in inverse depth: so does the depth, with its square. Where
/// the inverse depth is measured too large by e, the point lies nearer by `e z ρ` along its ray (z: depth, ρ: range, metre).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedErrorGrid {
    first: usize,
    nodes: [usize; 2],
    spacing_px: f64,
}

impl SharedErrorGrid {
    /// The grid over an image; `first` is the column of its first node.
    pub fn new(first: usize, format: &ImageFormat) -> Self {
        let spacing_px = format.width.max(format.height) as f64 / INTERVALS as f64;
        let along = |pixels: usize| (pixels as f64 / spacing_px).ceil() as usize + 1;
        Self { first, nodes: [along(format.width), along(format.height)], spacing_px }
    }

    /// The columns, node by node along the rows of the image.
    pub fn columns(&self) -> Range<usize> {
        self.first..self.first + self.nodes[0] * self.nodes[1]
    }

    /// Nodes along a row and along a column of the image.
    pub fn nodes(&self) -> [usize; 2] {
        self.nodes
    }

    /// Distance of neighbouring nodes, pixel.
    pub fn spacing_px(&self) -> f64 {
        self.spacing_px
    }

    /// The nodes around a pixel: column and weight; of a pixel outside the image those of its edge.
    pub(crate) fn around(&self, pixel: [f64; 2]) -> [(usize, f64); 4] {
        let [(col, right), (row, below)] = [0, 1].map(|axis| {
            let last = (self.nodes[axis] - 1) as f64;
            // The edge of the image is half a pixel outside the centres of its pixels.
            let place = ((pixel[axis] + 0.5) / self.spacing_px).clamp(0.0, last);
            let before = place.floor().min(last - 1.0);
            (before as usize, place - before)
        });
        let node = |aside: usize, down: usize| self.first + (row + down) * self.nodes[0] + col + aside;
        [
            (node(0, 0), (1.0 - right) * (1.0 - below)),
            (node(1, 0), right * (1.0 - below)),
            (node(0, 1), (1.0 - right) * below),
            (node(1, 1), right * below),
        ]
    }
}
