//! Pairs of source nodes and target planes, found by projection, some at a time.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Without branches, all lanes are compared at once.
#![allow(clippy::needless_bitwise_bool)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
// Arrays are written out: `map` over them stays a call, of which a pair makes dozens.
#![allow(clippy::needless_range_loop)]

use icp_registration::TUKEY;
use nalgebra::{Isometry3, Vector3};
use point_cloud::SAME_SURFACE_COSINE;

use crate::partners::locate::Locate;
use crate::preparation::blocks::Block;
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::BLOCK;
use crate::preparation::node_table::whole;
use rigid_pose::SinglePose;

/// What decides on pairs and their weights.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rules {
    /// Added to the variance of every pair, for what is not yet aligned, m².
    pub extra_variance: f32,
    /// Widening of the biweight, beyond whose reach residuals have no weight.
    pub widening: f32,
}

impl Rules {
    /// Residuals beyond this multiple of their standard deviation have no weight.
    pub(crate) fn reach(self) -> f32 {
        self.widening * TUKEY as f32
    }
}

/// The source frame on its way to the target.
pub(crate) struct Moved<'a> {
    pub source: &'a OrganisedFrame,
    pub target: &'a OrganisedFrame,
    rules: Rules,
    pose: SinglePose,
    centre: [f32; 3],
    per_radius: f32,
}

/// Blocks that are worked on together: loops as long as all of their nodes are compiled for registers of any width, where those over one block are
/// taken apart node by node, and put together again with as many moves as sums.
pub(crate) const AT_ONCE: usize = 8;
/// Their nodes.
pub(crate) const LANES: usize = AT_ONCE * BLOCK;

/// Nodes of some blocks side by side; NaN behind the last one.
struct Lanes {
    position: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
    variance: [f32; LANES],
}

impl Lanes {
    #[inline(always)]
    fn of<'b>(blocks: impl Iterator<Item = &'b Block>) -> Self {
        let nothing = [f32::NAN; LANES];
        let mut lanes = Self { position: [nothing; 3], normal: [nothing; 3], variance: nothing };
        for (at, block) in blocks.take(AT_ONCE).enumerate() {
            let at = at * BLOCK..(at + 1) * BLOCK;
            for i in 0..3 {
                lanes.position[i][at.clone()].copy_from_slice(&block.position[i]);
                lanes.normal[i][at.clone()].copy_from_slice(&block.normal[i]);
            }
            lanes.variance[at].copy_from_slice(&block.variance);
        }
        lanes
    }
}

/// Pairs side by side; all zero where a node has no partner.
pub(crate) struct Pairs {
    /// Target normal.
    pub normal: [[f32; LANES]; 3],
    /// Rotated source normal.
    pub source_normal: [[f32; LANES]; 3],
    /// Moved source point from the centre, in units of the radius.
    pub lever: [[f32; LANES]; 3],
    /// Distance of the moved point from the target plane, metre.
    pub residual: [f32; LANES],
    /// Variance of the residual, m².
    pub variance: [f32; LANES],
    /// Weight of the robust kernel, between 0 and 1, over the variance.
    pub weight: [f32; LANES],
    /// Slope of the kernel's influence over the variance.
    pub slope: [f32; LANES],
}

/// Where nodes lie for the target; NaN where it has no plane.
pub(crate) struct Distances {
    /// The target's nodes.
    pub node: [u32; LANES],
    /// Distance beyond the target plane, seen from the target's camera, metre.
    pub residual: [f32; LANES],
    /// Variance of the residual, m².
    pub variance: [f32; LANES],
    /// Cosine between the normals.
    pub cosine: [f32; LANES],
}

impl<'a> Moved<'a> {
    /// `centre` and `radius`: about which and in which units motions are solved, target frame.
    pub(crate) fn new(
        source: &'a OrganisedFrame,
        target: &'a OrganisedFrame,
        pose: &Isometry3<f64>,
        centre: &Vector3<f64>,
        radius_m: f64,
    ) -> Self {
        Self {
            source,
            target,
            rules: Rules::default(),
            pose: SinglePose::new(pose),
            centre: [0, 1, 2].map(|i| centre[i] as f32),
            per_radius: (1.0 / radius_m) as f32,
        }
    }

    /// The same with pairs decided on by these.
    pub(crate) fn by(self, rules: Rules) -> Self {
        Self { rules, ..self }
    }

    /// The pairs of up to [`AT_ONCE`] blocks of source nodes.
    #[inline(always)]
    pub(crate) fn pairs<'b, L: Locate>(&self, locate: L, blocks: impl Iterator<Item = &'b Block>) -> Pairs {
        let (p, source_normal, planes, distances) = self.compared(locate, &Lanes::of(blocks));
        let (centre, per_radius, rules) = (self.centre, self.per_radius, self.rules);
        let (extra_variance, per_square_reach) = (rules.extra_variance, 1.0 / rules.reach().powi(2));
        let nothing = [0.0; LANES];
        let mut accepted = [false; LANES];
        let (mut variance, mut weight, mut slope, mut residual) = (nothing, nothing, nothing, nothing);
        for k in 0..LANES {
            variance[k] = distances.variance[k] + extra_variance;
            let information = 1.0 / variance[k];
            let u2 = distances.residual[k] * distances.residual[k] * information * per_square_reach;
            // NaN fails: no partner.
            accepted[k] = (distances.cosine[k] >= SAME_SURFACE_COSINE as f32) & (u2 < 1.0);
            let rest = 1.0 - u2;
            let (by_weight, by_slope) = (rest * rest * information, rest * (1.0 - 5.0 * u2) * information);
            weight[k] = if accepted[k] { by_weight } else { 0.0 };
            slope[k] = if accepted[k] { by_slope } else { 0.0 };
            residual[k] = if accepted[k] { distances.residual[k] } else { 0.0 };
        }
        let mut lever = [nothing; 3];
        for i in 0..3 {
            for k in 0..LANES {
                lever[i][k] = (p[i][k] - centre[i]) * per_radius;
            }
        }
        let normal = taken(&[planes[0], planes[1], planes[2]], &accepted);
        let (lever, source_normal) = (taken(&lever, &accepted), taken(&source_normal, &accepted));
        Pairs { normal, source_normal, lever, residual, variance, weight, slope }
    }

    /// Where the nodes of up to [`AT_ONCE`] blocks lie for the target.
    #[inline(always)]
    pub(crate) fn distances<'b, L: Locate>(&self, locate: L, blocks: impl Iterator<Item = &'b Block>) -> Distances {
        self.compared(locate, &Lanes::of(blocks)).3
    }

    /// Moved positions and normals, the planes on which they fall, and how far off they are.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    fn compared<L: Locate>(
        &self,
        locate: L,
        lanes: &Lanes,
    ) -> ([[f32; LANES]; 3], [[f32; LANES]; 3], [[f32; LANES]; 4], Distances) {
        let p = self.rotated(&lanes.position, self.pose.translation);
        let source_normal = self.rotated(&lanes.normal, [0.0; 3]);
        let (node, planes, variances, outside) = self.partners(locate, &p);
        let nothing = [0.0; LANES];
        let (mut residual, mut variance, mut cosine) = (nothing, nothing, nothing);
        for k in 0..LANES {
            let [a, b, c, d] = [planes[0][k], planes[1][k], planes[2][k], planes[3][k]];
            residual[k] = a * p[0][k] + b * p[1][k] + c * p[2][k] - d + outside[k];
            cosine[k] = a * source_normal[0][k] + b * source_normal[1][k] + c * source_normal[2][k];
            variance[k] = variances[k] + lanes.variance[k];
        }
        (p, source_normal, planes, Distances { node, residual, variance, cosine })
    }

    #[inline(always)]
    fn rotated(&self, vectors: &[[f32; LANES]; 3], shift: [f32; 3]) -> [[f32; LANES]; 3] {
        let mut moved = [[0.0; LANES]; 3];
        for i in 0..3 {
            let r = self.pose.rotation[i];
            for k in 0..LANES {
                moved[i][k] = r[0] * vectors[0][k] + r[1] * vectors[1][k] + r[2] * vectors[2][k] + shift[i];
            }
        }
        moved
    }

    /// The target nodes on which points fall, with their planes and variances; what is added to the residual: NaN for
    /// points outside the frame, which get the nearest node instead, else 0.
    #[inline(always)]
    #[allow(clippy::type_complexity)]
    fn partners<L: Locate>(
        &self,
        locate: L,
        p: &[[f32; LANES]; 3],
    ) -> ([u32; LANES], [[f32; LANES]; 4], [f32; LANES], [f32; LANES]) {
        let grid = &self.target.grid;
        let (cols, rows) = (grid.cols as f32, grid.rows as f32);
        let (most_col, most_row) = (cols - 0.5, rows - 0.5);
        let (mut u, mut v) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let per_depth = -1.0 / p[2][k];
            (u[k], v[k]) = (p[0][k] * per_depth, p[1][k] * per_depth);
        }
        let [at_col, at_row] = locate.nodes(&u, &v);
        let (mut node, mut outside) = ([0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let (col, row) = (at_col[k] + 0.5, at_row[k] + 0.5);
            // NaN fails.
            let inside = (p[2][k] < 0.0) & (col >= 0.0) & (row >= 0.0) & (col < cols) & (row < rows);
            outside[k] = if inside { 0.0 } else { f32::NAN };
            // No branches: they would be taken lane by lane. NaN becomes 0.
            let (col, row) = (if col > 0.0 { col } else { 0.0 }, if row > 0.0 { row } else { 0.0 });
            let col = if col < most_col { col } else { most_col };
            let row = if row < most_row { row } else { most_row };
            node[k] = whole(row.floor() * cols + col.floor());
        }
        let (mut nodes, mut variances) = ([[f32::NAN; 4]; LANES], [f32::NAN; LANES]);
        for k in 0..LANES {
            nodes[k] = self.target.planes[node[k] as usize];
            variances[k] = self.target.sigma[node[k] as usize];
        }
        let mut planes = [[0.0; LANES]; 4];
        for k in 0..LANES {
            variances[k] *= variances[k];
            for j in 0..4 {
                planes[j][k] = nodes[k][j];
            }
        }
        (node, planes, variances, outside)
    }
}

/// The accepted ones of some vectors, 0 instead of the others.
#[inline(always)]
fn taken(vectors: &[[f32; LANES]; 3], accepted: &[bool; LANES]) -> [[f32; LANES]; 3] {
    let mut taken = [[0.0; LANES]; 3];
    for i in 0..3 {
        for k in 0..LANES {
            taken[i][k] = if accepted[k] { vectors[i][k] } else { 0.0 };
        }
    }
    taken
}
