//! Where rays fall on the nodes of a frame, and work compiled for wide registers.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::{Grid, NodeLens};
use crate::preparation::node_table::NodeTable;

/// Where a ray (u, v, -1) falls on the grid of nodes, in nodes; NaN or beyond the grid where it does not.
pub(crate) trait Locate: Copy + Sync {
    /// Column and row.
    fn node(&self, u: f32, v: f32) -> [f32; 2];

    /// Columns and rows of rays side by side.
    #[inline(always)]
    fn nodes<const N: usize>(&self, u: &[f32; N], v: &[f32; N]) -> [[f32; N]; 2] {
        let mut nodes = [[0.0; N]; 2];
        for k in 0..N {
            [nodes[0][k], nodes[1][k]] = self.node(u[k], v[k]);
        }
        nodes
    }
}

/// A pinhole camera, in nodes.
#[derive(Clone, Copy)]
pub(crate) struct Pinhole {
    focal: [f32; 2],
    centre: [f32; 2],
}

impl Locate for Pinhole {
    #[inline(always)]
    fn node(&self, u: f32, v: f32) -> [f32; 2] {
        [u * self.focal[0] + self.centre[0], self.centre[1] - v * self.focal[1]]
    }
}

impl Locate for &NodeTable {
    #[inline(always)]
    fn node(&self, u: f32, v: f32) -> [f32; 2] {
        let [col, row] = self.read(&[u], &[v]);
        [col[0], row[0]]
    }

    #[inline(always)]
    fn nodes<const N: usize>(&self, u: &[f32; N], v: &[f32; N]) -> [[f32; N]; 2] {
        self.read(u, v)
    }
}

/// Something to be done with whatever camera the target has, compiled for wide registers where it is inlined.
pub(crate) trait WithLocate {
    type Output;
    fn run<L: Locate>(self, locate: L) -> Self::Output;
}

/// Does work with a camera, in wide registers.
pub(crate) fn run_wide<W: WithLocate, L: Locate>(work: W, locate: L) -> W::Output {
    pulp::Arch::new().dispatch(Wide { work, locate })
}

struct Wide<W, L> {
    work: W,
    locate: L,
}

impl<W: WithLocate, L: Locate> pulp::WithSimd for Wide<W, L> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> W::Output {
        self.work.run(self.locate)
    }
}

/// Calls `work` with the camera of a frame.
pub(crate) fn with_locate<W: WithLocate>(frame: &OrganisedFrame, work: W) -> W::Output {
    match &frame.grid.lens {
        NodeLens::Pinhole(focal, centre) => run_wide(work, Pinhole { focal: *focal, centre: *centre }),
        NodeLens::Table(table) => run_wide(work, table),
    }
}

/// The node on which a point in the frame of the camera falls.
#[inline(always)]
pub(crate) fn node_at<L: Locate>(grid: &Grid, locate: L, p: [f32; 3]) -> Option<usize> {
    let [col, row] = locate.node(-p[0] / p[2], -p[1] / p[2]);
    let (col, row) = (col + 0.5, row + 0.5);
    // NaN fails.
    let inside = p[2] < 0.0 && col >= 0.0 && row >= 0.0 && col < grid.cols as f32 && row < grid.rows as f32;
    inside.then(|| row as usize * grid.cols + col as usize)
}
