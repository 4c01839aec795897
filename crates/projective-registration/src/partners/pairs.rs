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

/// Pairs side by side; all zero where a node has no partner.
pub(crate) struct Pairs {
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
    /// Slope of the kernel's influence over the variance.
    pub slope: [f32; BLOCK],
}

/// Where nodes lie for the target; NaN where it has no plane.
pub(crate) struct Distances {
    /// The target's nodes.
    pub node: [u32; BLOCK],
    /// Distance beyond the target plane, seen from the target's camera, metre.
    pub residual: [f32; BLOCK],
    /// Variance of the residual, m².
    pub variance: [f32; BLOCK],
    /// Cosine between the normals.
    pub cosine: [f32; BLOCK],
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

    /// The pairs of a block of source nodes.
    #[inline(always)]
    pub(crate) fn pairs<L: Locate>(&self, locate: L, block: &Block) -> Pairs {
        let (p, source_normal, planes, distances) = self.compared(locate, block);
        let (centre, per_radius, rules) = (self.centre, self.per_radius, self.rules);
        let (extra_variance, per_square_reach) = (rules.extra_variance, 1.0 / rules.reach().powi(2));
        let nothing = [0.0; BLOCK];
        let mut accepted = [false; BLOCK];
        let (mut variance, mut weight, mut slope, mut residual) = (nothing, nothing, nothing, nothing);
        for k in 0..BLOCK {
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
            for k in 0..BLOCK {
                lever[i][k] = (p[i][k] - centre[i]) * per_radius;
            }
        }
        let normal = taken(&[planes[0], planes[1], planes[2]], &accepted);
        let (lever, source_normal) = (taken(&lever, &accepted), taken(&source_normal, &accepted));
        Pairs { normal, source_normal, lever, residual, variance, weight, slope }
    }

    /// Where the nodes of a block lie for the target.
    #[inline(always)]
    pub(crate) fn distances<L: Locate>(&self, locate: L, block: &Block) -> Distances {
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
        let p = self.rotated(&block.position, self.pose.translation);
        let source_normal = self.rotated(&block.normal, [0.0; 3]);
        let (node, planes, variances, outside) = self.partners(locate, &p);
        let nothing = [0.0; BLOCK];
        let (mut residual, mut variance, mut cosine) = (nothing, nothing, nothing);
        for k in 0..BLOCK {
            let [a, b, c, d] = [planes[0][k], planes[1][k], planes[2][k], planes[3][k]];
            residual[k] = a * p[0][k] + b * p[1][k] + c * p[2][k] - d + outside[k];
            cosine[k] = a * source_normal[0][k] + b * source_normal[1][k] + c * source_normal[2][k];
            variance[k] = variances[k] + block.variance[k];
        }
        (p, source_normal, planes, Distances { node, residual, variance, cosine })
    }

    #[inline(always)]
    fn rotated(&self, vectors: &[[f32; BLOCK]; 3], shift: [f32; 3]) -> [[f32; BLOCK]; 3] {
        let mut moved = [[0.0; BLOCK]; 3];
        for i in 0..3 {
            let r = self.pose.rotation[i];
            for k in 0..BLOCK {
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
        p: &[[f32; BLOCK]; 3],
    ) -> ([u32; BLOCK], [[f32; BLOCK]; 4], [f32; BLOCK], [f32; BLOCK]) {
        let grid = &self.target.grid;
        let (cols, rows) = (grid.cols as f32, grid.rows as f32);
        let (most_col, most_row) = (cols - 0.5, rows - 0.5);
        let (mut u, mut v) = ([0.0; BLOCK], [0.0; BLOCK]);
        for k in 0..BLOCK {
            let per_depth = -1.0 / p[2][k];
            (u[k], v[k]) = (p[0][k] * per_depth, p[1][k] * per_depth);
        }
        let [at_col, at_row] = locate.nodes(&u, &v);
        let (mut node, mut outside) = ([0; BLOCK], [0.0; BLOCK]);
        for k in 0..BLOCK {
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
        let (mut nodes, mut variances) = ([[f32::NAN; 4]; BLOCK], [f32::NAN; BLOCK]);
        for k in 0..BLOCK {
            nodes[k] = self.target.planes[node[k] as usize];
            variances[k] = self.target.sigma[node[k] as usize];
        }
        let mut planes = [[0.0; BLOCK]; 4];
        for k in 0..BLOCK {
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
fn taken(vectors: &[[f32; BLOCK]; 3], accepted: &[bool; BLOCK]) -> [[f32; BLOCK]; 3] {
    let mut taken = [[0.0; BLOCK]; 3];
    for i in 0..3 {
        for k in 0..BLOCK {
            taken[i][k] = if accepted[k] { vectors[i][k] } else { 0.0 };
        }
    }
    taken
}
