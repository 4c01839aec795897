//! The grids of nodes that a frame is reduced to: each node stands for a square of pixels.

use std::sync::Arc;

use crate::preparation::legendre::{DEGREE, legendre_along};
use crate::preparation::node_table::NodeTable;
use crate::preparation::projection::Lens;

/// Number of nodes that large frames are reduced to. Averages of squares carry what their pixels say about the pose
/// (noise averages out in the sums anyway), but each pair then costs as much as one of single pixels.
const NODES: f64 = 34_000.0;
/// Frames with at least so many pixels have nodes of at least 2 x 2 pixels: single pixels cost three times as much. In
/// smaller frames (176 x 144) the planes of larger nodes miss the small surfaces that keep half-overlapping frames from
/// sliding along walls.
const PIXELS_TO_REDUCE: usize = 30_000;

/// Distances of the nodes of the levels, coarse to fine.
pub(crate) const STRIDES: [usize; 4] = [8, 4, 2, 1];
/// Nodes that are worked on together.
pub(crate) const BLOCK: usize = 8;
/// Cells across the longer side of the frame: nodes of a cell share errors.
const CELLS: usize = 24;
/// Cells of a square frame.
pub(crate) const MOST_CELLS: usize = CELLS * CELLS;
/// Stands for no node where a level does not fill its last block.
pub(crate) const NO_NODE: u32 = u32::MAX;

/// The part of a grid that turns directions into nodes.
#[derive(Debug)]
pub(crate) enum NodeLens {
    /// Focal lengths and principal point in nodes.
    Pinhole([f32; 2], [f32; 2]),
    Table(NodeTable),
}

/// Nodes of a frame, row by row, with their rays (x, y, -1) in the camera frame.
#[derive(Debug)]
pub(crate) struct Grid {
    /// Pixels a side that one node stands for.
    pub bin: usize,
    pub cols: usize,
    pub rows: usize,
    /// On which node a ray falls.
    pub lens: NodeLens,
    /// x/depth of the rays.
    pub u: Vec<f32>,
    /// y/depth of the rays.
    pub v: Vec<f32>,
    /// Cosine between the rays and the optical axis.
    pub cosine: Vec<f32>,
    /// Legendre polynomials at the columns and at the rows of nodes.
    pub legendre: [Vec<[f64; DEGREE + 1]>; 2],
    /// Turns the gradient of a function along columns and rows of nodes into that along u and v:
    /// `du = m[0] dc + m[1] dr`, `dv = m[2] dc + m[3] dr`.
    pub gradient: Vec<[f32; 4]>,
    /// The nodes level by level: coarse ones first, then what each finer level adds, cell by cell.
    pub order: Vec<[u32; BLOCK]>,
    /// Cells of the nodes of `order`, below `cell_count`.
    pub cells: Vec<[u16; BLOCK]>,
    pub cell_count: usize,
    /// Blocks of `order` that make up each level.
    pub levels: [usize; STRIDES.len()],
}

impl Grid {
    /// For frames of a size, and of twice as large nodes.
    pub(crate) fn fine_and_coarse(
        width: usize,
        height: usize,
        lens: &Lens,
        rays: impl Fn(usize, usize) -> [f64; 2],
    ) -> [Arc<Self>; 2] {
        let least = if width * height < PIXELS_TO_REDUCE { 1 } else { 2 };
        let bin = ((width as f64 * height as f64 / NODES).sqrt().round() as usize).max(least);
        [bin, 2 * bin].map(|bin| Arc::new(Self::new(bin, width, height, lens, &rays)))
    }

    fn new(bin: usize, width: usize, height: usize, lens: &Lens, rays: &impl Fn(usize, usize) -> [f64; 2]) -> Self {
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
        let of_nodes = match lens {
            Lens::Pinhole { focal_px, centre_px } => {
                let size = bin as f64;
                // Pixel p lies at node (p - (bin - 1) / 2) / bin.
                let centre = centre_px.map(|c| ((c - (size - 1.0) / 2.0) / size) as f32);
                NodeLens::Pinhole(focal_px.map(|f| (f / size) as f32), centre)
            }
            Lens::Table(_) => NodeLens::Table(NodeTable::new(cols, rows, &rays)),
        };
        let gradient = (0..cols * rows).map(|k| gradient(&rays, cols, rows, k, lens, bin)).collect();
        let tiles = Tiles::new(cols, rows);
        let (order, levels) = by_levels(cols, rows, &tiles);
        let cells = order.iter().map(|block| block.map(|node| tiles.cell(node))).collect();
        Self {
            cells,
            cell_count: tiles.count,
            bin,
            cols,
            rows,
            lens: of_nodes,
            order,
            levels,
            u: rays.iter().map(|r| r[0] as f32).collect(),
            v: rays.iter().map(|r| r[1] as f32).collect(),
            cosine: rays.iter().map(|r| (1.0 / (1.0 + r[0] * r[0] + r[1] * r[1]).sqrt()) as f32).collect(),
            legendre: [cols, rows].map(legendre_along),
            gradient,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.cols * self.rows
    }

    /// x/depth and y/depth of the ray through a place near a node, in nodes along columns and rows from its middle.
    pub(crate) fn ray(&self, k: usize, place: [f32; 2]) -> [f32; 2] {
        let ([a, b, c, d], [right, down]) = (self.gradient[k], place);
        let determinant = a * d - b * c;
        [self.u[k] + (d * right - c * down) / determinant, self.v[k] + (a * down - b * right) / determinant]
    }
}

/// The squares of nodes that are the cells of a frame.
struct Tiles {
    cols: usize,
    /// Nodes along a side.
    side: usize,
    across: usize,
    count: usize,
}

impl Tiles {
    fn new(cols: usize, rows: usize) -> Self {
        let side = cols.max(rows).div_ceil(CELLS).max(1);
        let across = cols.div_ceil(side);
        Self { cols, side, across, count: across * rows.div_ceil(side) }
    }

    /// The cell of a node; the first one where there is no node.
    fn cell(&self, node: u32) -> u16 {
        let node = if node == NO_NODE { 0 } else { node as usize };
        (node / self.cols / self.side * self.across + node % self.cols / self.side) as u16
    }
}

/// Blocks of nodes, level by level, and how many of them each level has.
fn by_levels(cols: usize, rows: usize, tiles: &Tiles) -> (Vec<[u32; BLOCK]>, [usize; STRIDES.len()]) {
    let (mut order, mut levels) = (Vec::new(), [0; STRIDES.len()]);
    for (level, &stride) in STRIDES.iter().enumerate() {
        let mut nodes = Vec::new();
        for row in (0..rows).step_by(stride) {
            // Nodes of the coarser levels are there already.
            let done = level > 0 && row % STRIDES[level - 1] == 0;
            let (first, step) = if done { (stride, 2 * stride) } else { (0, stride) };
            nodes.extend((first..cols).step_by(step).map(|col| (row * cols + col) as u32));
        }
        // Blocks that lie in one cell are summed up at once.
        nodes.sort_by_key(|node| tiles.cell(*node));
        order.extend(nodes.chunks(BLOCK).map(|chunk| {
            let mut block = [NO_NODE; BLOCK];
            block[..chunk.len()].copy_from_slice(chunk);
            block
        }));
        levels[level] = order.len();
    }
    (order, levels)
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
