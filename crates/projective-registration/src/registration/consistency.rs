//! How two frames agree at a given pose: on the surfaces they share, and on the space that both have looked through.
//!
//! Clouds are judged by `global_registration::agreement`, from voxels and maps of directions. Frames have both already: they
//! are compared in 0.2 ms, while their clouds take 35 ms to be prepared, six times as long as the registration.
// Only what is inlined is compiled for wide registers.
#![allow(clippy::inline_always)]
// Lanes lie side by side: with an index, loops read as their formulas and have the same length everywhere.
#![allow(clippy::needless_range_loop)]

use std::ops::Add;

use nalgebra::{Isometry3, Vector3};

use crate::partners::locate::{Locate, WithLocate, with_locate};
use crate::partners::pairs::{AT_ONCE, LANES, Moved};
use crate::partners::track::Frames;
use crate::preparation::blocks::Block;
use crate::preparation::frame::OrganisedFrame;
use crate::preparation::grid::STRIDES;
use crate::preparation::planes::HALF;

/// Distance from a plane within which nodes agree with it, in units of the frames' radius.
pub(crate) const TOLERANCE: f64 = 0.04;
/// Its smallest multiple of the standard deviation of a pair.
const SIGMAS: f32 = 3.0;
/// Multiple of the distance within which nodes agree, beyond which they contradict.
const CLEARLY: f32 = 2.0;
/// Smallest cosine between normals that agree.
const LEAST_COSINE: f32 = 0.8;
/// Level on which frames are compared to see whether a pose can be doubted: every fourth node.
pub(crate) const DOUBT_LEVEL: usize = 1;
/// Distance of the nodes of a frame that are compared: nearer ones have planes through the same nodes.
const APART: usize = 2 * HALF + 1;

/// Where the nodes of one frame lie for another, at a pose. The sum of both directions says more than one of them: what
/// one camera takes for hidden, the other may have seen through.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameConsistency {
    /// On a plane of the other frame, with its normal.
    pub agreeing: usize,
    /// Clearly in front of a plane of the other frame, whose camera saw through the place.
    pub contradicting: usize,
    /// Clearly behind a plane of the other frame, hidden by it.
    pub hidden: usize,
    /// Near a plane of the other frame, but neither on it with its normal nor clearly off it.
    pub unclear: usize,
    /// Outside the other frame, or where it has no plane.
    pub out_of_view: usize,
}

impl FrameConsistency {
    /// All nodes with a plane.
    pub fn all(&self) -> usize {
        self.agreeing + self.contradicting + self.hidden + self.unclear + self.out_of_view
    }

    /// Nodes of which both frames say something: those that agree, contradict or are unclear.
    pub fn compared(&self) -> usize {
        self.agreeing + self.contradicting + self.unclear
    }
}

impl Add for FrameConsistency {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            agreeing: self.agreeing + other.agreeing,
            contradicting: self.contradicting + other.contradicting,
            hidden: self.hidden + other.hidden,
            unclear: self.unclear + other.unclear,
            out_of_view: self.out_of_view + other.out_of_view,
        }
    }
}

/// Compares two frames in both directions at a pose `target_from_source`, without changing it: a test of poses that come
/// from elsewhere, such as the hypotheses of a relocalisation. `stride`: every how many nodes along columns and rows are
/// compared, rounded down to 1, 2, 4 or 8. A node agrees with a plane within 0.04 of the larger frame's radius and what noise does.
///
/// A pose that is not finite leaves all nodes out of view.
pub fn frame_consistency(
    source: &OrganisedFrame,
    target: &OrganisedFrame,
    target_from_source: &Isometry3<f64>,
    stride: usize,
) -> FrameConsistency {
    let level = STRIDES.iter().position(|s| *s <= stride).unwrap_or(STRIDES.len() - 1);
    let radius_m = source.points.radius_m.max(target.points.radius_m);
    consistency(Frames::new(source, target), target_from_source, level, TOLERANCE * radius_m)
}

/// As [`frame_consistency`], with the number of a level.
pub(crate) fn consistency(
    frames: Frames<'_>,
    pose: &Isometry3<f64>,
    level: usize,
    tolerance_m: f64,
) -> FrameConsistency {
    let (there, back) = rayon::join(
        || one_way(frames, pose, level, tolerance_m),
        || one_way(Frames::new(frames.target, frames.source), &pose.inverse(), level, tolerance_m),
    );
    there + back
}

fn one_way(frames: Frames<'_>, pose: &Isometry3<f64>, level: usize, tolerance_m: f64) -> FrameConsistency {
    let Frames { source, target, .. } = frames;
    let moved = Moved::new(source, target, pose, &Vector3::zeros(), 1.0);
    let mut counts = FrameConsistency::default();
    let compare =
        Compare { moved: &moved, blocks: frames.blocks(level), tolerance: tolerance_m as f32, counts: &mut counts };
    with_locate(target, compare);
    let out_of_view = source.points.counts[level] - counts.compared() - counts.hidden;
    FrameConsistency { out_of_view, ..counts }
}

impl OrganisedFrame {
    /// Share of the nodes that are unclear beside the plane of the frame's own next node through other pixels, along columns
    /// and along rows: what pairs of frames show at their right pose, whose planes share no pixels either.
    pub(crate) fn unevenness(&self, tolerance_m: f64) -> f64 {
        let grid = &self.grid;
        let (mut near, mut unclear) = (0_usize, 0_usize);
        for row in (0..grid.rows.saturating_sub(APART)).step_by(STRIDES[DOUBT_LEVEL]) {
            for col in (0..grid.cols.saturating_sub(APART)).step_by(STRIDES[DOUBT_LEVEL]) {
                let k = row * grid.cols + col;
                for other in [k + APART, k + APART * grid.cols] {
                    let (plane, beside) = (self.planes[k], self.planes[other]);
                    let dot = |v: [f32; 3]| plane[0] * v[0] + plane[1] * v[1] + plane[2] * v[2];
                    let residual = dot([grid.u[other], grid.v[other], -1.0]) / self.inverse_depth[other] - plane[3];
                    let cosine = dot([beside[0], beside[1], beside[2]]);
                    // NaN fails.
                    let is_near = residual.abs() <= tolerance_m as f32 && cosine.is_finite();
                    near += usize::from(is_near);
                    unclear += usize::from(is_near && cosine < LEAST_COSINE);
                }
            }
        }
        unclear as f64 / near.max(1) as f64
    }
}

struct Compare<'a, 'b> {
    moved: &'a Moved<'b>,
    blocks: &'a [Block],
    tolerance: f32,
    counts: &'a mut FrameConsistency,
}

impl WithLocate for Compare<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Locate>(self, locate: L) {
        // Agreeing, contradicting, hidden, unclear.
        let mut sums = [[0_u32; LANES]; 4];
        for blocks in self.blocks.chunks(AT_ONCE) {
            let distances = self.moved.distances(locate, blocks.iter());
            for k in 0..LANES {
                let (residual, cosine) = (distances.residual[k], distances.cosine[k]);
                let tolerance = self.tolerance + SIGMAS * distances.variance[k].sqrt();
                // Normals lead away from the cameras: what lies in front of a plane is below it. NaN fails everywhere.
                let near = residual.abs() <= tolerance;
                let agrees = near && cosine >= LEAST_COSINE;
                let contradicts = residual < -CLEARLY * tolerance;
                let hidden = residual > CLEARLY * tolerance;
                let unclear = residual.is_finite() && !(agrees || contradicts || hidden);
                for (sum, is) in sums.iter_mut().zip([agrees, contradicts, hidden, unclear]) {
                    sum[k] += u32::from(is);
                }
            }
        }
        let [agreeing, contradicting, hidden, unclear] = sums.map(|lanes| lanes.iter().sum::<u32>() as usize);
        *self.counts = FrameConsistency { agreeing, contradicting, hidden, unclear, out_of_view: 0 };
    }
}

#[cfg(test)]
mod tests {
    use crate::partners::drawn::drawn;

    #[test]
    fn walls_are_even_and_waves_are_not() {
        let tolerance = 0.05;
        assert!(drawn(|u, v| 2.0 / (1.0 + 0.2 * u - 0.1 * v)).unevenness(tolerance) < 1e-12);
        // Waves as long as six pixels, which slope by up to 45 degrees.
        let uneven = drawn(|u, _| 2.0 + 0.012 * (u * 160.0).sin()).unevenness(tolerance);
        assert!((0.05..0.6).contains(&uneven), "{uneven}");
    }
}
