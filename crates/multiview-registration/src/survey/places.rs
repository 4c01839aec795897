//! Whether stations would fit better in another place: slid along what their surfaces tell least, among the planes that the others saw.
//!
//! Where little stands along a wall, the patches of the wide rounds may leave a station decimetres from its place, or all those beyond
//! it, and shared planes that are not met there pull them no more. But their points tell: in the right place more of them lie on what
//! the others saw.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;

use crate::adjustment::network::Network;
use crate::adjustment::precision;
use crate::adjustment::rounds::FEWEST_CONTACTS;
use crate::adjustment::simultaneous::Adjusted;
use crate::error::Result;
use crate::planes::elimination::motion_of;
use crate::planes::sightings::{Gate, Sighting, Wide, members};
use crate::planes::sums::Sums;
use crate::surfaces::points::StationPoints;
use crate::survey::joint_covariance::JointCovariance;
use icp_registration::RobustKernel;
use rigid_pose::eigen6;

/// Points of a station that make a tile one that it saw.
const FEWEST_POINTS: usize = 5;
/// Steps of a slide, patches.
const STEP: f64 = 0.25;
/// Of so many points one tells which slides are worth refining: those that keep this share of what lies on planes now, and at most
/// so many.
const STRIDE: usize = 4;
const KEPT: f64 = 0.97;
const REFINED: usize = 3;
/// Steps onto the planes, each with points given to them anew, and what poses may be off before the last, patches.
const STEPS: usize = 4;
const OFF: f64 = 0.1;
/// Deviation of a relative pose beyond which two stations do not hold each other, patches: shared planes are joined within as much.
const LOOSE: f64 = 0.05;
/// Stations on either side of what little holds that tell where they began.
const NEAREST: usize = 24;
/// Standard deviations by which more points must lie on planes elsewhere: as probable as one in a million stations.
const SIGMAS: f64 = 5.0;

/// The planes of an adjustment, and where stations are sought among them.
pub(crate) struct Places<'a> {
    adjusted: &'a Adjusted,
    points: &'a [StationPoints],
    network: &'a Network<'a>,
    /// Where stations began.
    start: &'a [Isometry3<f64>],
    size_m: f64,
    /// How far they are sought.
    reach_m: f64,
    wide: Wide,
    members: Vec<Vec<(u32, u32)>>,
}

/// Stations that move as one, with how many of their points lie on what the others saw.
struct Place {
    /// Of all of them, in the world.
    motion: Isometry3<f64>,
    points: usize,
    /// By shift and turn about their middle.
    normal: Matrix6<f64>,
    right: Vector6<f64>,
}

impl<'a> Places<'a> {
    pub(crate) fn new(
        adjusted: &'a Adjusted,
        points: &'a [StationPoints],
        start: &'a [Isometry3<f64>],
        network: &'a Network<'a>,
        (size_m, reach_m): (f64, f64),
    ) -> Self {
        let planes = &adjusted.shared_planes;
        let (wide, members) = (Wide::new(planes), members(points.len(), planes));
        Self { adjusted, points, network, start, size_m, reach_m, wide, members }
    }

    /// Moves stations to where they fit better; returns which.
    pub(crate) fn improved(&self, poses: &mut [Isometry3<f64>]) -> Result<BTreeSet<usize>> {
        let tiles = self.adjusted.shared_planes.last().map_or(0, |plane| plane.tiles.first + plane.tiles.len());
        let mut by = vec![0; tiles];
        let mut moved = self.parts_as_begun(poses, &mut by)?;
        let of_one = |station: usize| -> Result<Option<(usize, Isometry3<f64>)>> {
            // What it alone saw says nothing.
            let own: Vec<usize> = self.seen(station).collect();
            let by_others = |tile: usize| by[tile] > u32::from(own.binary_search(&tile).is_ok());
            let better = Sought::new(self, &[station], poses, &by_others).better()?;
            Ok(better.map(|motion| (station, motion)))
        };
        let single = (0..poses.len()).into_par_iter().filter(|station| !moved.contains(station));
        let better: Vec<_> = single.map(of_one).collect::<Result<_>>()?;
        for (station, motion) in better.into_iter().flatten() {
            move_by(&motion, &mut poses[station]);
            moved.insert(station);
        }
        Ok(moved)
    }

    /// Moves parts of the network that little holds to where they began; returns which stations. `by`: how many saw each tile.
    fn parts_as_begun(&self, poses: &mut [Isometry3<f64>], by: &mut [u32]) -> Result<BTreeSet<usize>> {
        let parts = self.rigid();
        let largest = (0..parts.len()).max_by_key(|part| (parts[*part].len(), Reverse(*part))).unwrap_or(0);
        let (mut moved, mut placed) = (BTreeSet::new(), Vec::new());
        for part in self.order(&parts, largest) {
            let by_others = |tile: usize| by[tile] > 0;
            let own = &parts[part];
            if let Some(motion) = Sought::new(self, own, poses, &by_others).as_begun(own, &placed, poses)? {
                for &station in own {
                    move_by(&motion, &mut poses[station]);
                }
                moved.extend(own);
            }
            for tile in own.iter().flat_map(|station| self.seen(*station)) {
                by[tile] += 1;
            }
            placed.extend(own);
        }
        Ok(moved)
    }

    /// Tiles that a station saw, ascending.
    fn seen(&self, station: usize) -> impl Iterator<Item = usize> + '_ {
        let sums: &Sums = &self.adjusted.sums[station];
        (0..sums.tiles()).filter(|slot| sums.count(*slot) >= FEWEST_POINTS).map(|slot| sums.tile(slot))
    }

    /// Pairs of stations with enough tiles in common.
    fn pairs(&self) -> impl Iterator<Item = ([usize; 2], usize)> + '_ {
        let pairs = self.adjusted.common.pairs.iter().filter(|(_, tiles)| tiles.len() >= FEWEST_CONTACTS);
        pairs.map(|(&(a, b), tiles)| ([a as usize, b as usize], tiles.len()))
    }

    /// Parts of the network within which pairs of stations leave no motion open.
    fn rigid(&self) -> Vec<Vec<usize>> {
        let state = &self.adjusted.state;
        let joint = JointCovariance::new(self.adjusted.cofactors.clone(), self.adjusted.variance_factor());
        let holds = |[a, b]: [usize; 2]| {
            let (pose, covariance) = joint.relative_pose(&state.poses, a, b);
            precision::undetermined(&pose, &covariance, self.network.hold_m, LOOSE * self.size_m).is_empty()
        };
        let mut part: Vec<usize> = (0..state.poses.len()).collect();
        for (ends, _) in self.pairs() {
            let [a, b] = ends.map(|end| root(&part, end));
            if a != b && holds(ends) {
                part[a.max(b)] = a.min(b);
            }
        }
        let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for station in 0..part.len() {
            parts.entry(root(&part, station)).or_default().push(station);
        }
        parts.into_values().collect()
    }

    /// One part and the others that it leads to, each the one with the most tiles in common with those before it.
    fn order(&self, parts: &[Vec<usize>], first: usize) -> Vec<usize> {
        let mut part_of = vec![0; self.points.len()];
        for (part, stations) in parts.iter().enumerate() {
            for &station in stations {
                part_of[station] = part;
            }
        }
        // With those in the order.
        let mut common = vec![0; parts.len()];
        let mut order = Vec::new();
        let mut next = Some(first);
        while let Some(part) = next {
            order.push(part);
            for (ends, tiles) in self.pairs() {
                let [a, b] = ends.map(|end| part_of[end]);
                if a != b && (a == part || b == part) {
                    common[a + b - part] += tiles;
                }
            }
            let open = (0..parts.len()).filter(|part| !order.contains(part) && common[*part] > 0);
            next = open.max_by_key(|part| (common[*part], Reverse(*part)));
        }
        order
    }
}

/// The first of the stations that one belongs to.
fn root(part: &[usize], mut station: usize) -> usize {
    while part[station] != station {
        station = part[station];
    }
    station
}

fn move_by(motion: &Isometry3<f64>, pose: &mut Isometry3<f64>) {
    *pose = motion * *pose;
    pose.rotation.renormalize();
}

/// Stations that move as one among what others saw.
struct Sought<'a> {
    places: &'a Places<'a>,
    /// Those that saw something of that, and their poses.
    stations: Vec<(usize, Isometry3<f64>)>,
    middle: Vector3<f64>,
    /// Distance at which turns count as lengths.
    radius_m: f64,
    by_others: &'a (dyn Fn(usize) -> bool + Sync),
}

impl<'a> Sought<'a> {
    fn new(
        places: &'a Places<'a>,
        stations: &[usize],
        poses: &[Isometry3<f64>],
        by_others: &'a (dyn Fn(usize) -> bool + Sync),
    ) -> Self {
        let beside = |station: &&usize| stations.len() == 1 || places.seen(**station).any(by_others);
        let stations: Vec<(usize, Isometry3<f64>)> =
            stations.iter().filter(beside).map(|station| (*station, poses[*station])).collect();
        let n = stations.len().max(1) as f64;
        let middle = stations.iter().fold(Vector3::zeros(), |sum, (_, pose)| sum + pose.translation.vector / n);
        let apart = stations.iter().map(|(_, pose)| (pose.translation.vector - middle).norm_squared() / n).sum::<f64>();
        let radius_m = (apart + places.network.hold_m.powi(2)).sqrt();
        Self { places, stations, middle, radius_m, by_others }
    }

    /// Where they fit better than now.
    fn better(&self) -> Result<Option<Isometry3<f64>>> {
        let rough = self.at(&Isometry3::identity(), 0.0, STRIDE);
        let slide = self.weakest(&rough.normal)?;
        let step_m = STEP * self.places.size_m;
        let steps = (self.places.reach_m / step_m).ceil() as i32;
        // The next place on either side leads here.
        let slides = (-steps..=steps).filter(|step| step.abs() > 1);
        let motions: Vec<Isometry3<f64>> =
            slides.map(|step| self.motion(&(slide * (f64::from(step) * step_m)))).collect();
        let mut others: Vec<Place> = motions.par_iter().map(|motion| self.at(motion, 0.0, STRIDE)).collect();
        others.retain(|place| place.points as f64 > KEPT * rough.points as f64);
        // Stable: of equal ones the first.
        others.sort_by_key(|place| Reverse(place.points));
        // Among planes that hold still the station may leave what held it where it is.
        let from = std::iter::once(Isometry3::identity()).chain(others.iter().take(REFINED).map(|place| place.motion));
        let refined = from.map(|motion| self.refined(&motion));
        let Some(best) = refined.reduce(|a, b| if b.points > a.points { b } else { a }) else { return Ok(None) };
        let now = self.at(&Isometry3::identity(), 0.0, 1);
        let all: usize = self.stations.iter().map(|(station, _)| self.places.points[*station].points.len()).sum();
        // So many may be explained by one of the two places alone.
        let either = (2 * all).saturating_sub(best.points + now.points) as f64;
        let is_better = best.points as f64 - now.points as f64 > SIGMAS * either.sqrt();
        Ok(is_better.then_some(best.motion))
    }

    /// The motion of a part that little holds to where its stations began, on average, as against those beside it: shared planes tell
    /// from there. `None` where it is there.
    fn as_begun(&self, part: &[usize], placed: &[usize], poses: &[Isometry3<f64>]) -> Result<Option<Isometry3<f64>>> {
        if self.stations.is_empty() || placed.is_empty() {
            return Ok(None);
        }
        let slide = self.weakest(&self.at(&Isometry3::identity(), 0.0, 1).normal)?;
        let shift = Vector3::new(slide[0], slide[1], slide[2]);
        let began = |stations: &[usize]| {
            let apart = |station: &usize| (poses[*station].translation.vector - self.middle).norm_squared();
            let mut near = stations.to_vec();
            near.sort_by(|a, b| apart(a).total_cmp(&apart(b)).then(a.cmp(b)));
            near.truncate(NEAREST);
            let place = |poses: &[Isometry3<f64>], station: &usize| poses[*station].translation.vector;
            let off = |station: &usize| place(self.places.start, station) - place(poses, station);
            near.iter().map(off).sum::<Vector3<f64>>() / near.len() as f64
        };
        // What turns more than it slides stays.
        let back_m = shift.dot(&(began(part) - began(placed))) / shift.norm_squared().max(0.5);
        Ok((back_m.abs() > LOOSE * self.places.size_m).then(|| self.motion(&(slide * back_m))))
    }

    /// The motion by shift and turn about the middle.
    fn motion(&self, step: &Vector6<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
        let shift = Vector3::new(step[0], step[1], step[2]);
        Isometry3::from_parts((shift + self.middle - turn * self.middle).into(), turn)
    }

    /// The motion that the points tell least, turns as lengths at the radius.
    fn weakest(&self, normal: &Matrix6<f64>) -> Result<Vector6<f64>> {
        let scale = Vector6::from_fn(|k, _| if k < 3 { 1.0 } else { 1.0 / self.radius_m });
        let scaled = Matrix6::from_fn(|r, c| normal[(r, c)] * scale[r] * scale[c]);
        let (values, vectors) = eigen6(&scaled, "the normal equations of stations among others")?;
        Ok(vectors.column(values.imin()).component_mul(&scale))
    }

    /// The points of the stations moved so, which may be off by some length.
    fn at(&self, motion: &Isometry3<f64>, slack_m: f64, stride: usize) -> Place {
        let planes = &self.places.adjusted.shared_planes;
        let gate = Gate { kernel: RobustKernel::Tukey, slack_m, stride, parameters: 0 };
        let mut place = Place { motion: *motion, points: 0, normal: Matrix6::zeros(), right: Vector6::zeros() };
        for (station, pose) in &self.stations {
            let pose = motion * pose;
            let (points, members) = (&self.places.points[*station], &self.places.members[*station]);
            let sums = Sighting::new(points, &pose, planes, gate).sums(&self.places.wide, members);
            let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
            for slot in (0..sums.tiles()).filter(|slot| (self.by_others)(sums.tile(*slot))) {
                let Some(own) = sums.at(slot) else { continue };
                let plane = planes.partition_point(|plane| plane.tiles.first <= sums.tile(slot)) - 1;
                let motion = motion_of(&planes[plane], &pose);
                normal += motion * Matrix3::from_fn(|i, j| own.product(i, j)) * motion.transpose();
                right += motion * Vector3::from_fn(|i, _| own.right(i));
                place.points += sums.count(slot);
            }
            let by = self.tangent(&pose);
            place.normal += by.transpose() * normal * by;
            place.right += by.transpose() * right;
        }
        place
    }

    /// How the tangent of a pose follows shift and turn about the middle.
    fn tangent(&self, pose: &Isometry3<f64>) -> Matrix6<f64> {
        let mut by = Matrix6::identity();
        by.fixed_view_mut::<3, 3>(0, 3).copy_from(&(self.middle - pose.translation.vector).cross_matrix());
        by.fixed_view_mut::<3, 3>(3, 3).copy_from(&pose.rotation.inverse().to_rotation_matrix().into_inner());
        by
    }

    /// The stations moved onto the planes.
    fn refined(&self, from: &Isometry3<f64>) -> Place {
        let hold_m = self.places.size_m / 2.0;
        let mut motion = *from;
        for _ in 0..STEPS {
            let Place { mut normal, right, .. } = self.at(&motion, OFF * self.places.size_m, 1);
            (0..6).for_each(|k| normal[(k, k)] += if k < 3 { hold_m } else { hold_m / self.radius_m }.powi(-2));
            let Some(factor) = normal.cholesky() else { break };
            motion = self.motion(&-factor.solve(&right)) * motion;
        }
        self.at(&motion, 0.0, 1)
    }
}
