//! The grid of nodes that a frame is reduced to: each node stands for a square of pixels.

use super::projection::Lens;

/// Number of nodes that large frames are reduced to. Averages of squares carry what their pixels say about the pose
/// (noise averages out in the sums anyway), but each pair then costs as much as one of single pixels.
const NODES: f64 = 34_000.0;
/// Frames with at least so many pixels have nodes of at least 2 x 2 pixels: single pixels tell no better pose, only
/// dearer.
const PIXELS_TO_REDUCE: usize = 16_000;

/// Nodes of a frame, row by row, with their rays (x, y, -1) in the camera frame.
#[derive(Debug)]
pub(crate) struct Grid {
    /// Pixels a side that one node stands for.
    pub bin: usize,
    pub cols: usize,
    pub rows: usize,
    /// x/depth of the rays.
    pub u: Vec<f32>,
    /// y/depth of the rays.
    pub v: Vec<f32>,
    /// Cosine between the rays and the optical axis.
    pub cosine: Vec<f32>,
    /// Turns the gradient of a function along columns and rows of nodes into that along u and v:
    /// `du = m[0] dc + m[1] dr`, `dv = m[2] dc + m[3] dr`.
    pub gradient: Vec<[f32; 4]>,
}

impl Grid {
    pub(crate) fn new(width: usize, height: usize, lens: &Lens, rays: impl Fn(usize, usize) -> [f64; 2]) -> Self {
        let least = if width * height < PIXELS_TO_REDUCE { 1 } else { 2 };
        let bin = ((width as f64 * height as f64 / NODES).sqrt().round() as usize).max(least);
        let (cols, rows) = (width / bin, height / bin);
        let mean_ray = |col: usize, row: usize| {
            let mut sum = [0.0; 2];
            for k in 0..bin * bin {
                let ray = rays(col * bin + k % bin, row * bin + k / bin);
                sum = [sum[0] + ray[0], sum[1] + ray[1]];
            }
            sum.map(|s| s / (bin * bin) as f64)
        };
        let rays: Vec<[f64; 2]> = (0..cols * rows).map(|k| mean_ray(k % cols, k / cols)).collect();
        let gradient = (0..cols * rows).map(|k| gradient(&rays, cols, rows, k, lens, bin)).collect();
        Self {
            bin,
            cols,
            rows,
            u: rays.iter().map(|r| r[0] as f32).collect(),
            v: rays.iter().map(|r| r[1] as f32).collect(),
            cosine: rays.iter().map(|r| (1.0 / (1.0 + r[0] * r[0] + r[1] * r[1]).sqrt()) as f32).collect(),
            gradient,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.cols * self.rows
    }
}

/// Inverse transpose of the derivatives of (u, v) by the node's column and row, from its neighbours.
fn gradient(rays: &[[f64; 2]], cols: usize, rows: usize, k: usize, lens: &Lens, bin: usize) -> [f32; 4] {
    if let Lens::Pinhole { focal_px, .. } = lens {
        return [(focal_px[0] / bin as f64) as f32, 0.0, 0.0, (-focal_px[1] / bin as f64) as f32];
    }
    let (col, row) = (k % cols, k / cols);
    let (left, right) = (col.saturating_sub(1), (col + 1).min(cols - 1));
    let (above, below) = (row.saturating_sub(1), (row + 1).min(rows - 1));
    let slope = |a: [f64; 2], b: [f64; 2], steps: usize| [0, 1].map(|i| (b[i] - a[i]) / steps.max(1) as f64);
    let by_col = slope(rays[row * cols + left], rays[row * cols + right], right - left);
    let by_row = slope(rays[above * cols + col], rays[below * cols + col], below - above);
    let determinant = by_col[0] * by_row[1] - by_col[1] * by_row[0];
    // Rays that do not spread give infinities here, and no planes later.
    [by_row[1], -by_col[1], -by_row[0], by_col[0]].map(|m| (m / determinant) as f32)
}
