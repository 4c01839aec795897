//! Joints of the network: where hardly any surface holds all stations on one side against those on the other.
//!
//! At the end of a corridor stations may see but a wall with some furniture along which everything beyond could slide, and what holds it
//! is a face that is seen edge-on, or what was met there by chance. But rays go through what the other side saw wherever it
//! stands in the wrong place, and where they do so on both sides of a place, it lies between.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use rayon::prelude::*;
use rigid_pose::{eigen6, step_pose};

use crate::adjustment::joint_covariance::JointCovariance;
use crate::adjustment::known::SIGMAS;
use crate::agreement::loops::reached;
use crate::error::Result;
use crate::places::search::{LOOSE, Places, move_by, pairs};
use crate::places::sought::AGAINST_IT;
use crate::planes::shared_planes::root;
use crate::relative_pose::{RelativePose, Rows};

/// Deviation of a relative pose from which a joint is looked at, patches: in buildings neighbours are held to 1 to 7 thousandths of one, and
/// what hangs on a single face that was met in the wrong place to 13 (80 mm off). Smaller values only take time.
const WEAK: f64 = 0.01;
/// Steps of a slide, patches: an eighth of a pixel. Where rays begin to speak against a place they do so within some pixels.
const STEP: f64 = 0.025;
/// Stations on either side that tell where they began: of more, those farther off, bends of the network tell as well.
const NEAREST: usize = 24;

/// Two stations, and the motion that what lies between them tells least.
pub(crate) struct Weakest {
    pub stations: [usize; 2],
    /// Tangent of the pose of the second in the frame of the first by a metre of that motion, turns as lengths at a radius, and the other way.
    pub tangent: Vector6<f64>,
    pub metres: Vector6<f64>,
    /// Standard deviation of it.
    pub sigma_m: f64,
}

impl Weakest {
    fn new(places: &Places<'_>, joint: &JointCovariance, stations: [usize; 2]) -> Result<Self> {
        let (_, covariance) = joint.relative_pose(&places.adjusted.state.poses, stations[0], stations[1]);
        let hold_m = places.network.hold_m;
        let scale = Vector6::new(1.0, 1.0, 1.0, hold_m, hold_m, hold_m);
        let scaled = covariance.map_with_location(|row, column, value| value * scale[row] * scale[column]);
        let (values, vectors) = eigen6(&scaled, "the covariance of a relative pose")?;
        let largest = values.imax();
        let along: Vector6<f64> = vectors.column(largest).into_owned();
        let (tangent, metres) = (along.component_div(&scale), along.component_mul(&scale));
        Ok(Self { stations, tangent, metres, sigma_m: values[largest].max(0.0).sqrt() })
    }

    /// The second station in the frame of the first after a slide.
    fn slid(&self, poses: &[Isometry3<f64>], slide_m: f64) -> Isometry3<f64> {
        let [first, second] = self.stations.map(|station| poses[station]);
        step_pose(&(first.inverse() * second), &(self.tangent * slide_m))
    }

    /// The motion of all beyond, in the world.
    fn motion(&self, poses: &[Isometry3<f64>], beyond: &[bool], slide_m: f64) -> Isometry3<f64> {
        let ([first, second], slid) = (self.stations.map(|station| poses[station]), self.slid(poses, slide_m));
        if beyond[self.stations[1]] {
            first * slid * second.inverse()
        } else {
            second * slid.inverse() * first.inverse()
        }
    }
}

/// Between which slides rays do not speak against a place.
#[derive(Debug, Clone, Copy)]
struct Between {
    middle_m: f64,
    half_m: f64,
    /// Whether they do where the stations are.
    is_elsewhere: bool,
}

impl Places<'_> {
    /// Slides what lies beyond weak joints to where rays have it, or where it began; returns what was slid, and whether anything is known
    /// of joints that was not before.
    pub(crate) fn joined(
        &self,
        poses: &mut [Isometry3<f64>],
        joints: &mut Vec<RelativePose>,
    ) -> Result<(BTreeSet<usize>, bool)> {
        let (mut moved, before) = (BTreeSet::new(), joints.clone());
        let tree = self.tree()?;
        for weakest in tree.iter().filter(|joint| joint.sigma_m > WEAK * self.size_m) {
            let beyond = self.beyond(&tree, weakest.stations);
            if self.slid(weakest, &beyond, poses, joints) {
                moved.extend((0..poses.len()).filter(|station| beyond[*station]));
            }
        }
        Ok((moved, *joints != before))
    }

    /// The pairs that hold all stations best, weakest first.
    fn tree(&self) -> Result<Vec<Weakest>> {
        let joint = JointCovariance::new(self.adjusted.cofactors.clone(), self.adjusted.factor);
        let all: Vec<[usize; 2]> = pairs(self.adjusted).collect();
        let mut all: Vec<Weakest> =
            all.par_iter().map(|ends| Weakest::new(self, &joint, *ends)).collect::<Result<_>>()?;
        // Stable: of equal ones the first.
        all.sort_by(|a, b| a.sigma_m.total_cmp(&b.sigma_m));
        let mut part: Vec<usize> = (0..self.points.len()).collect();
        all.retain(|pair| {
            let [a, b] = pair.stations.map(|end| root(&part, end));
            part[a.max(b)] = a.min(b);
            a != b
        });
        all.reverse();
        Ok(all)
    }

    /// Which stations lie on the other side of a pair of the tree than the one that is held.
    fn beyond(&self, tree: &[Weakest], joint: [usize; 2]) -> Vec<bool> {
        let others = tree.iter().map(|pair| pair.stations).filter(|pair| *pair != joint);
        let here = reached(&others.map(|[a, b]| (a, b)).collect::<Vec<_>>(), self.network.fixed);
        (0..self.points.len()).map(|station| !here.contains(&station)).collect()
    }

    /// Slides what lies beyond a joint; returns whether it has moved.
    pub(crate) fn slid(
        &self,
        weakest: &Weakest,
        beyond: &[bool],
        poses: &mut [Isometry3<f64>],
        joints: &mut Vec<RelativePose>,
    ) -> bool {
        let is_loose = weakest.sigma_m > LOOSE * self.size_m;
        let begun = self.begun(weakest, beyond, poses);
        let slide_m = match self.between_rays(weakest, beyond, poses, begun) {
            Some(Between { middle_m, half_m, is_elsewhere }) if is_loose || is_elsewhere => {
                let sigma_m = half_m / 3.0_f64.sqrt();
                let across = |joint: &RelativePose| beyond[joint.stations[0]] != beyond[joint.stations[1]];
                if middle_m.abs() <= sigma_m && joints.iter().any(across) {
                    return false;
                }
                joints.retain(|joint| !across(joint));
                let first_from_second = weakest.slid(poses, middle_m);
                let rows = Rows::from_rows(&[weakest.metres.transpose() / sigma_m]);
                joints.push(RelativePose { stations: weakest.stations, first_from_second, rows });
                middle_m
            }
            None if is_loose => begun.0,
            _ => 0.0,
        };
        let motion = weakest.motion(poses, beyond, slide_m);
        for (pose, _) in poses.iter_mut().zip(beyond).filter(|(_, beyond)| **beyond) {
            move_by(&motion, pose);
        }
        slide_m.abs() > LOOSE * self.size_m
    }

    /// How far from where they began as against the other side those beyond a joint are, and its standard deviation, metre.
    fn begun(&self, weakest: &Weakest, beyond: &[bool], poses: &[Isometry3<f64>]) -> (f64, f64) {
        let middle = poses[weakest.stations[0]].translation.vector;
        let slide = weakest.motion(poses, beyond, self.size_m) * Point3::from(middle);
        let slide = (slide.coords - middle) / self.size_m;
        let of_side = |side: bool| {
            let apart = |station: &usize| (poses[*station].translation.vector - middle).norm_squared();
            let mut near: Vec<usize> = (0..poses.len()).filter(|station| beyond[*station] == side).collect();
            near.sort_by(|a, b| apart(a).total_cmp(&apart(b)).then(a.cmp(b)));
            near.truncate(NEAREST);
            let off = |station: &usize| self.start[*station].translation.vector - poses[*station].translation.vector;
            let n = near.len() as f64;
            (near.iter().map(off).sum::<Vector3<f64>>() / n, 1.0 / n)
        };
        let (own, others) = (of_side(true), of_side(false));
        // What turns more than it slides stays.
        let back_m = slide.dot(&(own.0 - others.0)) / slide.norm_squared().max(0.5);
        (back_m.clamp(-self.reach_m, self.reach_m), self.known_m * (own.1 + others.1).sqrt())
    }

    /// The places about where those beyond a joint began, or are, that rays do not speak against; `None` where they do not on both sides
    /// of them.
    fn between_rays(
        &self,
        weakest: &Weakest,
        beyond: &[bool],
        poses: &[Isometry3<f64>],
        (back_m, known_m): (f64, f64),
    ) -> Option<Between> {
        let step_m = STEP * self.size_m;
        let reach_m = (SIGMAS * known_m).max(self.size_m);
        let [low, high] =
            [back_m.min(0.0) - reach_m, back_m.max(0.0) + reach_m].map(|slide_m| (slide_m / step_m).round() as i32);
        let motions: Vec<Isometry3<f64>> =
            (low..=high).map(|step| weakest.motion(poses, beyond, f64::from(step) * step_m)).collect();
        let crossing: Vec<[usize; 2]> = pairs(self.adjusted).filter(|[a, b]| beyond[*a] != beyond[*b]).collect();
        let against = |&[a, b]: &[usize; 2]| -> Vec<usize> {
            let (moved, other) = if beyond[a] { (a, b) } else { (b, a) };
            let relative = motions.iter().map(|motion| poses[other].inverse() * motion * poses[moved]);
            relative.map(|pose| self.looked_through.between(moved, other, &pose)).collect()
        };
        let each: Vec<Vec<usize>> = crossing.par_iter().map(against).collect();
        let counts: Vec<usize> = (0..motions.len()).map(|k| each.iter().map(|of_pair| of_pair[k]).sum()).collect();
        let best = (0..counts.len()).min_by_key(|k| counts[*k])?;
        let more = |k: usize| {
            let (count, least) = (counts[k] as f64, counts[best] as f64);
            (count - least) / (count + least).max(1.0).sqrt()
        };
        let before = (0..best).rev().find(|k| more(*k) > AGAINST_IT)?;
        let behind = (best..counts.len()).find(|k| more(*k) > AGAINST_IT)?;
        let at = |k: usize| (f64::from(low) + k as f64) * step_m;
        let (middle_m, half_m) = (0.5 * (at(before) + at(behind)), 0.5 * (at(behind) - at(before)));
        Some(Between { middle_m, half_m, is_elsewhere: more(-low as usize) > SIGMAS })
    }
}
