//! A frame as a piece of a map: how well another agrees with it, what it learns from it, and what it looks like.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Without branches, all lanes are compared at once.
#![allow(clippy::needless_bitwise_bool)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use std::ops::Range;

use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::SAME_SURFACE_COSINE;

use crate::partners::locate::{Locate, WithLocate, node_at, with_locate};
use crate::partners::pairs::{AT_ONCE, LANES, Moved};
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::BLOCK;
use rigid_pose::SinglePose;

/// Distances from a plane within this multiple of their standard deviation agree with it.
pub(crate) const AGREEING_SIGMA: f32 = 4.0;
/// What maps and poses are wrong by beside the noise: this share of the depth.
const AGREEING_SHARE: f32 = 0.005;
/// Frames that a plane remembers: later ones keep this weight, so that a keyframe does not stiffen.
const MEMORY: f32 = 16.0;
/// Logarithm of the largest factor between depths that are told apart.
const LARGEST_LOGARITHM: f32 = 0.3;

/// How the points of a frame lie to the planes of another.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Points tried.
    pub points: usize,
    /// Those on a plane.
    pub agreeing: usize,
    /// Those where the other frame looked through, or saw a surface that runs across.
    pub contradicting: usize,
}

impl Agreement {
    /// Largest systematic error of a sensor, share of the depth: 6 cm at 2 m, several times that of a Kinect. With 0.02 and 0.05 its paths are
    /// as far off within a millimetre or two, and those of simulated frames the same.
    pub const LARGEST_ERROR: f32 = 0.03;
    /// Nodes by which agreement is judged: its shares are then good to a hundredth.
    pub const NODES: usize = 2500;
    /// Fraction of what can be judged that must agree where a pose has to be trusted by that alone.
    pub const LEAST_CONSENT: f64 = 0.9;
    /// Fraction of all points that must agree for a pose to be told at all. With 0.2 and 0.3 the paths of 500 frames of a Kinect were the
    /// same within 2 mm; with 0.5 half of the loops are lost.
    pub const LEAST_OVERLAP: f64 = 0.25;

    /// Fraction of all points that agree.
    pub fn overlap(&self) -> f64 {
        self.agreeing as f64 / self.points.max(1) as f64
    }

    /// Fraction of the points that could be judged that agree. What lies behind a surface cannot be judged.
    pub fn consent(&self) -> f64 {
        self.agreeing as f64 / (self.agreeing + self.contradicting).max(1) as f64
    }
}

impl OrganisedFrame {
    /// How about `most` nodes of `source`, spread over its frame, agree with the planes of this one.
    pub fn agreement(&self, source: &Self, self_from_source: &Isometry3<f64>, most: usize) -> Agreement {
        let stride = source.stride_for(most);
        let mut agreement = Agreement::default();
        let judge = |p: Option<Partner>| {
            agreement.points += 1;
            let Some(p) = p else { return };
            if p.agrees() {
                agreement.agreeing += 1;
            } else if p.residual < p.tolerance() {
                agreement.contradicting += 1;
            }
        };
        with_locate(self, Partners { target: self, source, pose: self_from_source, stride, each: judge });
        agreement
    }

    /// Fraction of about `most` nodes of `source` that may lie on the surfaces of this one, where errors of sensor and pose are up to `error`, a
    /// part of the depth.
    pub fn nearness(&self, source: &Self, self_from_source: &Isometry3<f64>, most: usize, error: f32) -> f64 {
        let stride = source.stride_for(most);
        let (mut points, mut near) = (0_usize, 0_usize);
        let count = |partner: Option<Partner>| {
            points += 1;
            near += usize::from(partner.is_some_and(|p| p.lies_within(error)));
        };
        with_locate(self, Partners { target: self, source, pose: self_from_source, stride, each: count });
        near as f64 / points.max(1) as f64
    }

    /// Every how many nodes along columns and rows about `most` are left.
    pub(crate) fn stride_for(&self, most: usize) -> usize {
        (self.grid.len() as f64 / most.max(1) as f64).sqrt().ceil().max(1.0) as usize
    }

    /// Moves the planes of this frame to the weighted mean with the points of `source`, those within their noise.
    pub fn absorb(&mut self, source: &Self, self_from_source: &Isometry3<f64>, scratch: &mut AbsorbScratch) {
        let moved = Moved::new(source, self, self_from_source, &Vector3::zeros(), 1.0);
        with_locate(self, Learning { moved: &moved, learned: &mut scratch.lanes });
        for lanes in &scratch.lanes {
            for k in 0..LANES {
                let (node, source_variance) = (lanes.node[k] as usize, lanes.variance[k]);
                let (plane, sigma) = (&mut self.planes[node], &mut self.sigma[node]);
                let variance = *sigma * *sigma;
                let gain = (variance / (variance + source_variance)).max(1.0 / MEMORY);
                let learnt = ((1.0 - gain) * variance).max(source_variance / MEMORY).min(variance).sqrt();
                // No branches: half of them would be guessed wrong at edges.
                plane[3] += if lanes.fits[k] { gain * lanes.residual[k] } else { 0.0 };
                *sigma = if lanes.fits[k] { learnt } else { *sigma };
            }
        }
    }

    /// Mean logarithm of the depth in `cols x rows` fields of the frame; NaN where a field is mostly empty.
    pub fn thumbnail(&self, cols: usize, rows: usize) -> Vec<f32> {
        let grid = &self.grid;
        let (mut sums, mut counts) = (vec![0.0; cols * rows], vec![0_usize; cols * rows]);
        let border = |index: usize, nodes: usize, fields: usize| (index * nodes).div_ceil(fields);
        for row in 0..grid.rows {
            let first = row * rows / grid.rows * cols;
            for col in 0..cols {
                // One logarithm for the depths of a row: double precision holds their product.
                let (mut product, mut count) = (1.0_f64, 0);
                for node in border(col, grid.cols, cols)..border(col + 1, grid.cols, cols) {
                    if let Some((point, _)) = self.node(row * grid.cols + node) {
                        product *= -f64::from(point[2]);
                        count += 1;
                        if !(1e-100..1e100).contains(&product) {
                            sums[first + col] += product.ln();
                            product = 1.0;
                        }
                    }
                }
                sums[first + col] += product.ln();
                counts[first + col] += count;
            }
        }
        let full = grid.len() / (cols * rows);
        let mean = |(sum, count): (f64, usize)| if 4 * count > full { (sum / count as f64) as f32 } else { f32::NAN };
        sums.into_iter().zip(counts).map(mean).collect()
    }

    /// Direction of the ray at a fraction of the frame's width and height.
    pub fn direction(&self, across: f64, down: f64) -> Vector3<f64> {
        let grid = &self.grid;
        let at = |share: f64, size: usize| ((share * size as f64) as usize).min(size - 1);
        let k = at(down, grid.rows) * grid.cols + at(across, grid.cols);
        Vector3::new(f64::from(grid.u[k]), f64::from(grid.v[k]), -1.0)
    }

    /// The point of a node on its plane, and the plane's normal away from the camera.
    #[inline(always)]
    fn node(&self, k: usize) -> Option<([f32; 3], [f32; 3])> {
        let ([a, b, c, distance], grid) = (self.planes[k], &self.grid);
        let (u, v) = (grid.u[k], grid.v[k]);
        let depth = distance / (a * u + b * v - c);
        // NaN fails.
        (depth > 0.0 && depth < f32::INFINITY).then_some(([u * depth, v * depth, -depth], [a, b, c]))
    }

    /// The planes as they are now, as points on the rays of their nodes with normals towards the camera and sigma along
    /// them.
    pub fn surface(&self) -> impl Iterator<Item = (Point3<f64>, Vector3<f64>, f64)> {
        self.surface_of(0..self.nodes())
    }

    /// The same of some nodes; none beyond [`nodes`](Self::nodes).
    pub fn surface_of(&self, nodes: Range<usize>) -> impl Iterator<Item = (Point3<f64>, Vector3<f64>, f64)> {
        (nodes.start..nodes.end.min(self.nodes())).filter_map(|k| {
            let (point, normal) = self.node(k)?;
            let normal = -Vector3::from(normal.map(f64::from)).normalize();
            Some((Point3::from(point.map(f64::from)), normal, f64::from(self.sigma[k])))
        })
    }

    /// Number of nodes, with and without a plane.
    pub fn nodes(&self) -> usize {
        self.grid.len()
    }

    /// Fraction of the nodes that have a plane.
    pub fn filled(&self) -> f64 {
        self.len() as f64 / self.grid.len() as f64
    }

    /// Rms distance of the points from their centre, metre.
    pub fn radius_m(&self) -> f64 {
        self.points.radius_m
    }
}

/// Mean difference of two thumbnails, of which the second is shifted by fields to the right and down: 0 for the same, 1
/// for nothing in common.
pub fn thumbnail_difference(a: &[f32], b: &[f32], cols: usize, shift: [isize; 2]) -> f32 {
    let rows = a.len() / cols;
    let (mut sum, mut count) = (0.0, 0);
    for row in 0..rows {
        for col in 0..cols {
            let (c, r) = (col as isize - shift[0], row as isize - shift[1]);
            if c < 0 || r < 0 || c >= cols as isize || r >= rows as isize {
                continue;
            }
            let difference = (a[row * cols + col] - b[r as usize * cols + c as usize]).abs();
            if difference.is_finite() {
                sum += difference.min(LARGEST_LOGARITHM) / LARGEST_LOGARITHM;
                count += 1;
            }
        }
    }
    if 2 * count < a.len() { 1.0 } else { sum / count as f32 }
}

/// How a source point lies to the target plane it falls on.
pub(crate) struct Partner {
    /// The source's node.
    pub(crate) source: u32,
    /// The target's node.
    pub(crate) node: u32,
    /// In the target's frame.
    pub(crate) point: [f32; 3],
    /// Distance behind the plane, seen from the target camera, metre.
    pub(crate) residual: f32,
    cosine: f32,
    /// Of the residual, m².
    pub(crate) variance: f32,
}

impl Partner {
    /// Whether the point lies on the plane and its surface runs along it.
    pub(crate) fn agrees(&self) -> bool {
        self.residual.abs() <= self.tolerance() && self.cosine >= SAME_SURFACE_COSINE as f32
    }

    /// Whether it may be the same surface, measured with a systematic error.
    pub(crate) fn may_be_the_same(&self) -> bool {
        self.lies_within(Agreement::LARGEST_ERROR)
    }

    /// Whether it lies on the plane but for an error, a part of the depth, and its surface runs along it.
    fn lies_within(&self, error: f32) -> bool {
        self.residual.abs() <= AGREEING_SIGMA * self.variance.sqrt() - error * self.point[2]
            && self.cosine >= SAME_SURFACE_COSINE as f32
    }

    fn tolerance(&self) -> f32 {
        AGREEING_SIGMA * self.variance.sqrt() - AGREEING_SHARE * self.point[2]
    }
}

/// Memory of [`OrganisedFrame::absorb`] that is used again.
#[derive(Debug, Clone, Default)]
pub struct AbsorbScratch {
    lanes: Vec<Learned>,
}

/// The planes on which nodes fall, whether within their noise, with distance and variance of the nodes.
#[derive(Debug, Clone)]
struct Learned {
    node: [u32; LANES],
    residual: [f32; LANES],
    variance: [f32; LANES],
    fits: [bool; LANES],
}

struct Learning<'a, 'b> {
    moved: &'a Moved<'b>,
    learned: &'a mut Vec<Learned>,
}

impl WithLocate for Learning<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(self, locate: L) {
        let Self { moved, learned } = self;
        learned.clear();
        for blocks in moved.source.points.blocks.chunks(AT_ONCE) {
            let d = moved.distances(locate, blocks.iter());
            let (mut fits, mut variance) = ([false; LANES], [0.0; LANES]);
            for (at, block) in blocks.iter().enumerate() {
                variance[at * BLOCK..][..BLOCK].copy_from_slice(&block.variance);
            }
            for k in 0..LANES {
                // NaN fails.
                fits[k] =
                    (d.residual[k] * d.residual[k] < 9.0 * d.variance[k]) & (d.cosine[k] >= SAME_SURFACE_COSINE as f32);
            }
            learned.push(Learned { node: d.node, residual: d.residual, variance, fits });
        }
    }
}

/// Calls `each` for every `stride`-th node along rows and columns that has a plane, in order, with what it falls on.
pub(crate) struct Partners<'a, F> {
    pub(crate) target: &'a OrganisedFrame,
    pub(crate) source: &'a OrganisedFrame,
    pub pose: &'a Isometry3<f64>,
    pub(crate) stride: usize,
    pub(crate) each: F,
}

impl<F: FnMut(Option<Partner>)> WithLocate for Partners<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(mut self, locate: L) {
        let pose = SinglePose::new(self.pose);
        let (cols, rows) = (self.source.grid.cols, self.source.grid.rows);
        for row in (self.stride / 2..rows).step_by(self.stride) {
            for col in (self.stride / 2..cols).step_by(self.stride) {
                let k = row * cols + col;
                if let Some((point, normal)) = self.source.node(k) {
                    let (point, normal) = (pose.moved(point), pose.turned(normal));
                    let partner = self.partner(locate, k, point, normal);
                    (self.each)(partner);
                }
            }
        }
    }
}

impl<F> Partners<'_, F> {
    /// The plane on which a node of the source falls, its point and normal being in the target's frame.
    #[inline(always)]
    fn partner<L: Locate>(&self, locate: L, k: usize, point: [f32; 3], normal: [f32; 3]) -> Option<Partner> {
        let node = node_at(&self.target.grid, locate, point)?;
        let plane = self.target.planes[node];
        let dot = |v: &[f32; 3]| plane[0] * v[0] + plane[1] * v[1] + plane[2] * v[2];
        plane[3].is_finite().then(|| Partner {
            source: k as u32,
            node: node as u32,
            point,
            residual: dot(&point) - plane[3],
            cosine: dot(&normal),
            variance: self.target.sigma[node].powi(2) + self.source.sigma[k].powi(2),
        })
    }
}
