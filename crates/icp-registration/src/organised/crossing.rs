//! Nodes that tell a motion which most others leave open: their surfaces run across it.

use nalgebra::{Isometry3, Vector3};

use super::blocks::Block;
use super::consistency::counted;
use super::frame::OrganisedFrame;
use super::grid::{BLOCK, NO_NODE};
use crate::icp::{MotionKind, UndeterminedMotion};

/// Share of an open motion along its normal above which a node tells it. Normals of single nodes scatter by some 0.1.
const LEAST_SHARE: f64 = 0.3;

/// The nodes of two frames that tell some motions. On a wall with a small box, a thousand nodes agree wherever the frames
/// slide along it; these few do not.
pub(super) struct Crossing<'a> {
    frames: [&'a OrganisedFrame; 2],
    blocks: [Vec<Block>; 2],
}

impl<'a> Crossing<'a> {
    /// `motions` as they are open at `pose` (target from source).
    pub(super) fn new(
        source: &'a OrganisedFrame,
        target: &'a OrganisedFrame,
        pose: &Isometry3<f64>,
        motions: &[UndeterminedMotion],
    ) -> Self {
        let back = pose.inverse();
        let in_source: Vec<UndeterminedMotion> = motions
            .iter()
            .map(|motion| UndeterminedMotion { axis: back * motion.axis, through: back * motion.through, ..*motion })
            .collect();
        Self { frames: [source, target], blocks: [telling(source, &in_source), telling(target, motions)] }
    }

    /// How many of these nodes agree at a pose, less those that do not, both ways.
    pub(super) fn agreement(&self, pose: &Isometry3<f64>, tolerance_m: f64) -> f64 {
        let [source, target] = self.frames;
        let there = counted(source, target, pose, &self.blocks[0], tolerance_m);
        let both = there + counted(target, source, &pose.inverse(), &self.blocks[1], tolerance_m);
        both.agreeing as f64 - both.wrong() as f64
    }
}

/// The nodes of a frame whose normals have a share of one of the motions.
fn telling(frame: &OrganisedFrame, motions: &[UndeterminedMotion]) -> Vec<Block> {
    let nothing = [f32::NAN; BLOCK];
    let empty = Block { position: [nothing; 3], normal: [nothing; 3], variance: nothing, node: [NO_NODE; BLOCK] };
    let (mut blocks, mut filled) = (Vec::new(), BLOCK);
    for block in &frame.points.blocks {
        for k in 0..BLOCK {
            let [place, normal] =
                [&block.position, &block.normal].map(|v| Vector3::new(v[0][k], v[1][k], v[2][k]).cast::<f64>());
            // NaN fails.
            if !motions.iter().any(|motion| share(motion, &place, &normal, frame.points.radius_m) > LEAST_SHARE) {
                continue;
            }
            if filled == BLOCK {
                blocks.push(empty);
                filled = 0;
            }
            if let Some(last) = blocks.last_mut() {
                for i in 0..3 {
                    last.position[i][filled] = block.position[i][k];
                    last.normal[i][filled] = block.normal[i][k];
                }
                last.variance[filled] = block.variance[k];
                last.node[filled] = block.node[k];
            }
            filled += 1;
        }
    }
    blocks
}

/// How far a motion that moves points at the radius by one moves a place along its normal.
fn share(motion: &UndeterminedMotion, place: &Vector3<f64>, normal: &Vector3<f64>, radius_m: f64) -> f64 {
    let velocity = match motion.kind {
        MotionKind::Translation => motion.axis,
        MotionKind::Rotation => motion.axis.cross(&(place - motion.through.coords)) / radius_m,
    };
    velocity.dot(normal).abs()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::organised::drawn::drawn;

    /// A wall two metres away and a box before it, whose right side lies at x = -0.6, seen from `x` on the x axis.
    fn seen_from(x: f64) -> OrganisedFrame {
        let depth = |u: f64, v: f64| {
            let is_box = |depth: f64| (-1.0..=-0.599).contains(&(x + u * depth)) && (v * depth).abs() < 0.4;
            let side = (-0.6 - x) / u;
            if is_box(1.2) {
                1.2
            } else if (1.2..2.0).contains(&side) && is_box(side) {
                side
            } else {
                2.0
            }
        };
        drawn(depth)
    }

    #[test]
    fn the_side_of_a_box_tells_a_slide_along_its_wall() {
        let (target, source) = (seen_from(0.0), seen_from(0.1));
        let truth = Isometry3::translation(0.1, 0.0, 0.0);
        let slide = UndeterminedMotion {
            kind: MotionKind::Translation,
            axis: Vector3::x(),
            through: Point3::origin(),
            sigma_m: f64::INFINITY,
        };
        let crossing = Crossing::new(&source, &target, &truth, &[slide]);
        // The side fills a tenth of the frame, the wall and the front most of the rest.
        assert!(crossing.blocks[0].len() * 4 < source.points.blocks.len(), "walls tell nothing of a slide");
        let (there, slid) = (crossing.agreement(&truth, 0.02), crossing.agreement(&(slide_by(0.1) * truth), 0.02));
        assert!(there > 100.0 && slid < 0.0, "{there} where it belongs, {slid} beside");
    }

    fn slide_by(x: f64) -> Isometry3<f64> {
        Isometry3::translation(x, 0.0, 0.0)
    }
}
