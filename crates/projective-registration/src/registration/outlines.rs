//! Outlines: points at jumps, where no plane lies. They tell slides that planes leave open: what one camera sees in
//! front of a surface, the other has looked through.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use rayon::prelude::*;

use crate::partners::locate::{Locate, WithLocate, node_at, with_locate};
use crate::partners::map::AGREEING_SIGMA;
use crate::partners::track::{Frames, Track};
use crate::preparation::frame::OrganisedFrame;
use crate::registration::aligner::FrameAligner;
use icp_registration::{IcpResult, MotionKind, UndeterminedMotion};
use rigid_pose::SinglePose;

/// A point contradicts a plane that it lies in front of by this share of the radius and what noise does.
const TOLERANCE: f64 = 0.025;
/// Distance of the places that are tried along a motion, in units of the radius, and places on either side.
const STEP: f64 = 0.006;
const STEPS: usize = 50;
/// Points that may contradict by chance: a place is less probable by a factor of e for each such number.
const CHANCE: f64 = 3.0;
/// Points at jumps of a frame that are looked at.
const POINTS: usize = 1500;
/// Places with more points beyond the fewest, in units of what may be chance, are out of the question.
const LIMIT: f64 = 4.0;

/// The points at jumps of two frames.
struct Outlines<'a> {
    frames: Frames<'a>,
    points: [Vec<[f32; 3]>; 2],
    tolerance_m: f32,
}

impl<'a> Outlines<'a> {
    fn new(frames: Frames<'a>) -> Self {
        let tolerance_m = (TOLERANCE * frames.radius_m()) as f32;
        Self { frames, points: [frames.source.at_jumps(), frames.target.at_jumps()], tolerance_m }
    }

    /// Points at jumps of either frame that lie in front of planes of the other; where there are more than `most`, more than that.
    fn contradicting(&self, pose: &Isometry3<f64>, most: usize) -> usize {
        let (Frames { source, target, .. }, tolerance_m) = (self.frames, self.tolerance_m);
        let there = with_locate(target, InFront { target, points: &self.points[0], pose, tolerance_m, most });
        let (pose, most) = (&pose.inverse(), most.saturating_sub(there));
        there + with_locate(source, InFront { target: source, points: &self.points[1], pose, tolerance_m, most })
    }

    /// How far along a motion the frames contradict each other least, in metre at the radius.
    fn least(&self, pose: &Isometry3<f64>, motion: &UndeterminedMotion) -> f64 {
        let radius_m = self.frames.radius_m();
        let places: Vec<f64> = (0..=2 * STEPS).map(|k| (k as f64 - STEPS as f64) * STEP * radius_m).collect();
        let here = self.contradicting(pose, usize::MAX) as f64 / CHANCE;
        let against = |place: &f64| {
            let by_planes = 0.5 * (place / motion.sigma_m).powi(2);
            // What more speaks against than against this place is out of the question, whatever more there is.
            let most = (here + LIMIT - by_planes) * CHANCE;
            if most < 0.0 {
                return f64::INFINITY;
            }
            by_planes + self.contradicting(&along(pose, motion, *place, radius_m), most as usize) as f64 / CHANCE
        };
        let against: Vec<f64> = places.par_iter().map(against).collect();
        let fewest = against.iter().copied().fold(f64::INFINITY, f64::min);
        let possible = |k: usize| against[k] <= fewest + LIMIT;
        let Some(nearest) =
            (0..against.len()).filter(|k| against[*k] <= fewest + 0.5).min_by_key(|k| k.abs_diff(STEPS))
        else {
            return 0.0;
        };
        let first = (0..nearest).rev().find(|k| !possible(*k)).map(|k| k + 1);
        let end = (nearest..against.len()).find(|k| !possible(*k));
        // Where one side is open, the middle would run away.
        let (Some(first), Some(end)) = (first, end) else { return if possible(STEPS) { 0.0 } else { places[nearest] } };
        let weight = |k: usize| (fewest - against[k]).exp();
        let sum: f64 = (first..end).map(weight).sum();
        (first..end).map(|k| weight(k) * places[k]).sum::<f64>() / sum
    }
}

/// A pose moved along a motion by so much at the radius.
fn along(pose: &Isometry3<f64>, motion: &UndeterminedMotion, by_m: f64, radius_m: f64) -> Isometry3<f64> {
    match motion.kind {
        MotionKind::Translation => Translation3::from(motion.axis * by_m) * pose,
        MotionKind::Rotation => {
            let turn = UnitQuaternion::from_scaled_axis(motion.axis * (by_m / radius_m));
            let about = Translation3::from(motion.through.coords);
            about * turn * about.inverse() * pose
        }
    }
}

impl FrameAligner {
    /// Puts what planes leave open where outlines contradict each other least.
    pub(crate) fn placed_by_outlines(
        &mut self,
        mut best: (Track, IcpResult),
        frames: Frames<'_>,
    ) -> (Track, IcpResult) {
        let outlines = Outlines::new(frames);
        let radius_m = frames.radius_m();
        // What is moved along one motion tells the others better.
        for _ in 0..best.1.degenerate.len() {
            let (mut track, result) = (best.0.clone(), &best.1);
            let open = &result.degenerate;
            for motion in open.iter().cycle().take(open.len() * open.len()) {
                track.pose = along(&track.pose, motion, outlines.least(&track.pose, motion), radius_m);
            }
            track.iterations = 0;
            let against = outlines.contradicting(&result.target_from_source, usize::MAX);
            // What the geometry does not determine stays.
            let held = self
                .verdict(&track, frames, frames.all_blocks())
                .map(|verdict| Track { free: verdict.directions.free(), ..track });
            match held.and_then(|track| self.end(track, frames)) {
                Ok(other) if outlines.contradicting(&other.1.target_from_source, usize::MAX) <= against => best = other,
                _ => break,
            }
        }
        best
    }
}

impl OrganisedFrame {
    /// Points of nodes without a plane, of many some, spread over the frame.
    fn at_jumps(&self) -> Vec<[f32; 3]> {
        let at_jump =
            (0..self.planes.len()).filter(|&k| self.inverse_depth[k].is_finite() && !self.planes[k][3].is_finite());
        let point = |k: usize| {
            let (depth, [u, v]) = (1.0 / self.inverse_depth[k], self.grid.ray(k, self.place[k]));
            [u * depth, v * depth, -depth]
        };
        let points: Vec<[f32; 3]> = at_jump.map(point).collect();
        let step = points.len().div_ceil(POINTS).max(1);
        points.into_iter().step_by(step).collect()
    }
}

struct InFront<'a> {
    target: &'a OrganisedFrame,
    points: &'a [[f32; 3]],
    pose: &'a Isometry3<f64>,
    tolerance_m: f32,
    most: usize,
}

impl WithLocate for InFront<'_> {
    type Output = usize;

    fn run<L: Locate>(self, locate: L) -> usize {
        let pose = SinglePose::new(self.pose);
        let mut in_front = 0;
        for point in self.points {
            let p = pose.moved(*point);
            let Some(node) = node_at(&self.target.grid, locate, p) else { continue };
            let [a, b, c, d] = self.target.planes[node];
            // Normals lead away from the camera.
            let residual = a * p[0] + b * p[1] + c * p[2] - d;
            in_front += usize::from(residual < -(self.tolerance_m + AGREEING_SIGMA * self.target.sigma[node]));
            if in_front > self.most {
                break;
            }
        }
        in_front
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::FrameAlignmentOptions;
    use crate::partners::drawn::drawn;

    /// A plate of 0.6 m x 0.5 m, 1.2 m away, before a wall at 2 m, seen from a place beside the middle.
    fn seen_from(place: [f64; 2]) -> OrganisedFrame {
        drawn(|u, v| {
            let on_plate = (place[0] + u * 1.2).abs() < 0.3 && (place[1] + v * 1.2).abs() < 0.25;
            if on_plate { 1.2 } else { 2.0 }
        })
    }

    #[test]
    fn the_rim_of_a_plate_tells_what_its_plane_leaves_open() {
        let (target, source) = (seen_from([0.0, 0.0]), seen_from([0.06, -0.04]));
        let truth = Isometry3::translation(0.06, -0.04, 0.0);
        let guess = Isometry3::new(Vector3::new(0.1, 0.04, 0.02), Vector3::new(0.0, 0.0, 0.04));
        let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
        let result = aligner.align(&source, &target, &guess).unwrap();
        assert_eq!(result.degenerate.len(), 3, "planes tell neither slides nor the turn about their normal");
        let off = result.target_from_source.translation.vector - truth.translation.vector;
        // A pixel is 8 mm on the plate.
        assert!(
            off.norm() < 0.01 && result.target_from_source.rotation.angle() < 0.02,
            "{}",
            result.target_from_source
        );
    }

    #[test]
    fn where_one_side_is_open_nothing_runs_away() {
        let (target, source) = (seen_from([9.0, 0.0]), seen_from([9.1, 0.0]));
        let outlines = Outlines::new(Frames::new(&source, &target));
        let slide = UndeterminedMotion {
            kind: MotionKind::Translation,
            axis: Vector3::x(),
            through: Point3::origin(),
            sigma_m: f64::INFINITY,
        };
        // A bare wall.
        assert!(outlines.least(&Isometry3::identity(), &slide).abs() < 1e-12);
    }
}
