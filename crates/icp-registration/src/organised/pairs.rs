//! Pairs of source nodes and target planes, found by projection, some at a time.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Without branches, all lanes are compared at once.
#![allow(clippy::needless_bitwise_bool)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use nalgebra::{Isometry3, Vector3};

use super::blocks::Block;
use super::frame::OrganisedFrame;
use super::grid::BLOCK;
use super::projection::Lens;
use super::table::Table;

/// Above the number of nodes of any frame, and the bits of single precision that hold what is below it.
const TWO_TO_23: f32 = 8_388_608.0;
const LOW_BITS: u32 = (1 << 23) - 1;

/// Where a ray (u, v, -1) falls on the grid of nodes, in nodes; NaN or beyond the grid where it does not.
pub(super) trait Locate: Copy + Sync {
    fn node(&self, u: f32, v: f32) -> [f32; 2];
}

/// A pinhole camera, in nodes.
#[derive(Clone, Copy)]
pub(super) struct Pinhole {
    focal: [f32; 2],
    centre: [f32; 2],
}

impl Locate for Pinhole {
    #[inline(always)]
    fn node(&self, u: f32, v: f32) -> [f32; 2] {
        [u * self.focal[0] + self.centre[0], self.centre[1] - v * self.focal[1]]
    }
}

/// A table of pixels and the number of pixels a node.
#[derive(Clone, Copy)]
pub(super) struct Tabled<'a> {
    table: &'a Table,
    scale: f32,
    shift: f32,
}

impl Locate for Tabled<'_> {
    #[inline(always)]
    fn node(&self, u: f32, v: f32) -> [f32; 2] {
        self.table.read(u, v).map(|p| p * self.scale + self.shift)
    }
}

/// Something to be done with whatever camera the target has.
pub(super) trait WithLocate {
    type Output;
    fn run<L: Locate>(self, locate: L) -> Self::Output;
}

/// Calls `work` with the camera of a frame.
pub(super) fn with_locate<W: WithLocate>(frame: &OrganisedFrame, work: W) -> W::Output {
    let bin = frame.projection.grid.bin as f64;
    // Pixel p lies at node (p - (bin - 1) / 2) / bin.
    let shift = -(bin - 1.0) / 2.0;
    match frame.projection.lens() {
        Lens::Pinhole { focal_px, centre_px } => work.run(Pinhole {
            focal: focal_px.map(|f| (f / bin) as f32),
            centre: centre_px.map(|c| ((c + shift) / bin) as f32),
        }),
        Lens::Table(table) => work.run(Tabled { table, scale: (1.0 / bin) as f32, shift: (shift / bin) as f32 }),
    }
}

/// What decides on pairs and their weights.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rules {
    /// Added to the variance of every pair, for what is not yet aligned, m².
    pub extra_variance: f32,
    /// Residuals beyond this multiple of their standard deviation have no weight (biweight).
    pub reach: f32,
    /// Smallest cosine between the normals of a pair.
    pub least_cosine: f32,
}

/// The source frame on its way to the target.
pub(super) struct Moved<'a> {
    pub source: &'a OrganisedFrame,
    pub target: &'a OrganisedFrame,
    rotation: [[f32; 3]; 3],
    translation: [f32; 3],
    centre: [f32; 3],
    per_radius: f32,
}

/// Pairs side by side; all zero where a node has no partner.
pub(super) struct Pairs {
    /// Target normal.
    pub normal: [[f32; BLOCK]; 3],
    /// Rotated source normal.
    pub source_normal: [[f32; BLOCK]; 3],
    /// Moved source point from the centre, in units of the radius.
    pub lever: [[f32; BLOCK]; 3],
    /// Distance of the moved point from the target plane, metre.
    pub residual: [f32; BLOCK],
    /// Variance of the residual, m².
    pub variance: [f32; BLOCK],
    /// Weight of the robust kernel, between 0 and 1, over the variance.
    pub weight: [f32; BLOCK],
    /// Whether the point falls on a target plane at all.
    pub met: [bool; BLOCK],
    /// Slope of the kernel's influence over the variance.
    pub slope: [f32; BLOCK],
}

/// Where nodes lie for the target; NaN where it has no plane.
pub(super) struct Distances {
    /// The target's nodes; beyond all of them where there is none.
    pub node: [usize; BLOCK],
    /// Distance beyond the target plane, seen from the target's camera, metre.
    pub residual: [f32; BLOCK],
    /// Variance of the residual, m².
    pub variance: [f32; BLOCK],
    /// Cosine between the normals.
    pub cosine: [f32; BLOCK],
}

impl<'a> Moved<'a> {
    /// `centre` and `radius`: about which and in which units motions are solved, target frame.
    pub(super) fn new(
        source: &'a OrganisedFrame,
        target: &'a OrganisedFrame,
        pose: &Isometry3<f64>,
        centre: &Vector3<f64>,
        radius_m: f64,
    ) -> Self {
        let matrix = pose.rotation.to_rotation_matrix();
        Self {
            source,
            target,
            rotation: [0, 1, 2].map(|r| [0, 1, 2].map(|c| matrix[(r, c)] as f32)),
            translation: [0, 1, 2].map(|i| pose.translation.vector[i] as f32),
            centre: [0, 1, 2].map(|i| centre[i] as f32),
            per_radius: (1.0 / radius_m) as f32,
        }
    }

    /// The pairs of a block of source nodes.
    #[inline(always)]
    pub(super) fn pairs<L: Locate>(&self, locate: L, rules: &Rules, block: &Block) -> Pairs {
        let (p, source_normal, planes, distances) = self.compared(locate, block);
        let nothing = [0.0; BLOCK];
        let mut pairs = Pairs {
            normal: [planes[0], planes[1], planes[2]],
            source_normal,
            lever: [nothing; 3],
            residual: nothing,
            variance: nothing,
            weight: nothing,
            slope: nothing,
            met: [false; BLOCK],
        };
        for k in 0..BLOCK {
            let (residual, cosine) = (distances.residual[k], distances.cosine[k]);
            let variance = distances.variance[k] + rules.extra_variance;
            let u2 = residual * residual / (variance * rules.reach * rules.reach);
            // NaN fails: no partner.
            let accepted = cosine >= rules.least_cosine && u2 < 1.0;
            let rest = 1.0 - u2;
            pairs.weight[k] = if accepted { rest * rest / variance } else { 0.0 };
            pairs.slope[k] = if accepted { rest * (1.0 - 5.0 * u2) / variance } else { 0.0 };
            pairs.residual[k] = if accepted { residual } else { 0.0 };
            pairs.variance[k] = variance;
            pairs.met[k] = u2 >= 0.0;
            for i in 0..3 {
                pairs.lever[i][k] = if accepted { (p[i][k] - self.centre[i]) * self.per_radius } else { 0.0 };
                pairs.normal[i][k] = if accepted { pairs.normal[i][k] } else { 0.0 };
                pairs.source_normal[i][k] = if accepted { source_normal[i][k] } else { 0.0 };
            }
        }
        pairs
    }

    /// Where the nodes of a block lie for the target.
    #[inline(always)]
    pub(super) fn distances<L: Locate>(&self, locate: L, block: &Block) -> Distances {
        self.compared(locate, block).3
    }

    /// Moved positions and normals, the planes on which they fall, and how far off they are.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    fn compared<L: Locate>(
        &self,
        locate: L,
        block: &Block,
    ) -> ([[f32; BLOCK]; 3], [[f32; BLOCK]; 3], [[f32; BLOCK]; 4], Distances) {
        let p = self.rotated(&block.position, self.translation);
        let source_normal = self.rotated(&block.normal, [0.0; 3]);
        let (node, planes, variances) = self.partners(locate, &p);
        let nothing = [0.0; BLOCK];
        let mut distances = Distances { node, residual: nothing, variance: nothing, cosine: nothing };
        for k in 0..BLOCK {
            let [a, b, c, d] = [planes[0][k], planes[1][k], planes[2][k], planes[3][k]];
            distances.residual[k] = a * p[0][k] + b * p[1][k] + c * p[2][k] - d;
            distances.cosine[k] = a * source_normal[0][k] + b * source_normal[1][k] + c * source_normal[2][k];
            distances.variance[k] = variances[k] + block.variance[k];
        }
        (p, source_normal, planes, distances)
    }

    #[inline(always)]
    fn rotated(&self, vectors: &[[f32; BLOCK]; 3], shift: [f32; 3]) -> [[f32; BLOCK]; 3] {
        let mut moved = [[0.0; BLOCK]; 3];
        for i in 0..3 {
            let r = self.rotation[i];
            for k in 0..BLOCK {
                moved[i][k] = r[0] * vectors[0][k] + r[1] * vectors[1][k] + r[2] * vectors[2][k] + shift[i];
            }
        }
        moved
    }

    /// The target nodes on which points fall, with their planes and variances; NaN where there are none.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    fn partners<L: Locate>(
        &self,
        locate: L,
        p: &[[f32; BLOCK]; 3],
    ) -> ([usize; BLOCK], [[f32; BLOCK]; 4], [f32; BLOCK]) {
        let grid = &self.target.projection.grid;
        let (cols, rows) = (grid.cols as f32, grid.rows as f32);
        let mut index = [usize::MAX; BLOCK];
        let (mut col, mut row, mut inside) = ([0.0; BLOCK], [0.0; BLOCK], [false; BLOCK]);
        for k in 0..BLOCK {
            let per_depth = -1.0 / p[2][k];
            let node = locate.node(p[0][k] * per_depth, p[1][k] * per_depth);
            let at = node.map(|x| x + 0.5);
            // NaN fails.
            inside[k] = (p[2][k] < 0.0) & (at[0] >= 0.0) & (at[1] >= 0.0) & (at[0] < cols) & (at[1] < rows);
            col[k] = if inside[k] { at[0] } else { 0.0 };
            row[k] = if inside[k] { at[1] } else { 0.0 };
        }
        for k in 0..BLOCK {
            // Whole numbers below 2²³ as the low bits of their sum with it: a cast would be done lane by lane.
            let node = (row[k].floor() * cols + col[k].floor() + TWO_TO_23).to_bits() & LOW_BITS;
            index[k] = if inside[k] { node as usize } else { usize::MAX };
        }
        let (mut nodes, mut variances) = ([[f32::NAN; 4]; BLOCK], [f32::NAN; BLOCK]);
        let count = self.target.planes.len().min(self.target.sigma.len());
        let (all_planes, all_sigma) = (&self.target.planes[..count], &self.target.sigma[..count]);
        for k in 0..BLOCK {
            if index[k] < count {
                nodes[k] = all_planes[index[k]];
                variances[k] = all_sigma[index[k]].powi(2);
            }
        }
        let mut planes = [[f32::NAN; BLOCK]; 4];
        for j in 0..4 {
            for k in 0..BLOCK {
                planes[j][k] = nodes[k][j];
            }
        }
        (index, planes, variances)
    }
}
