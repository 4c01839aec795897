//! Whether stations would fit better in another place: slid along what their surfaces tell least, among the planes that the others saw.
//!
//! Where little stands along a wall, the patches of the wide rounds may leave a station decimetres from its place, or all those beyond
//! it, and shared planes that are not met there pull them no more. But their points tell: in the right place more of them lie on what
//! the others saw.
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Isometry3;
use rayon::prelude::*;

use crate::adjustment::network::Network;
use crate::adjustment::precision;
use crate::adjustment::rounds::{FEWEST_CONTACTS, KNOWN, Known};
use crate::adjustment::simultaneous::Adjusted;
use crate::agreement::looked_through::LookedThrough;
use crate::error::Result;
use crate::planes::sightings::{Gate, Sighting, Wide, members};
use crate::planes::sums::Sums;
use crate::surfaces::extents::Extent;
use crate::surfaces::points::{Block, StationPoints};
use crate::survey::joint_covariance::JointCovariance;
use crate::survey::sought::Sought;
use icp_registration::RobustKernel;

/// Points of a station that make a tile one that it saw.
const FEWEST_POINTS: usize = 5;
/// Deviation of a relative pose beyond which two stations do not hold each other, patches: shared planes are joined within as much.
pub(crate) const LOOSE: f64 = 0.05;

/// The planes of an adjustment, and where stations are sought among them.
pub(crate) struct Places<'a> {
    pub adjusted: &'a Adjusted,
    pub points: &'a [StationPoints],
    pub network: &'a Network<'a>,
    /// Where stations began.
    pub start: &'a [Isometry3<f64>],
    pub size_m: f64,
    /// How well that is known, which how far all have moved tells.
    pub known_m: f64,
    /// How far they are sought.
    pub reach_m: f64,
    pub wide: Wide,
    pub members: Vec<Vec<(u32, u32)>>,
    pub looked_through: LookedThrough,
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
        let [least, most] = [KNOWN * size_m, reach_m].map(|length_m| Known::at(length_m, network.hold_m));
        let known_m = Known::estimated(start, &adjusted.state.poses, least, most).position_m;
        let gate = Gate { kernel: RobustKernel::Tukey, slack_m: 0.0, stride: 1, parameters: 0 };
        let tiles = |station: usize| {
            let sighting = Sighting::new(&points[station], &adjusted.state.poses[station], planes, gate);
            sighting.sums_and_tiles(&wide, &members[station]).1
        };
        let tiles: Vec<Vec<u32>> = (0..points.len()).into_par_iter().map(tiles).collect();
        let looked_through = LookedThrough::new(points, &tiles, pairs(adjusted).map(|(ends, _)| ends));
        Self { adjusted, points, network, start, size_m, known_m, reach_m, wide, members, looked_through }
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
            let better = Sought::of_one(self, station, poses, &by_others).better(poses)?;
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

    /// The box about what a station may see from anywhere within reach of a pose, turned about something this far away.
    pub(crate) fn around(&self, station: usize, pose: &Isometry3<f64>, radius_m: f64) -> Extent {
        let blocks = &self.points[station].blocks;
        let far = |block: &Block| block.centre.coords.norm() + block.radius_m;
        let farthest_m = blocks.iter().map(far).fold(0.0, f64::max);
        // As far as sightings look about a block, and what it moves.
        let reach_m =
            |block: &Block| 3.0 * (block.radius_m + self.size_m) + self.reach_m * (1.0 + farthest_m / radius_m);
        let boxes = blocks.iter().map(|block| Extent::about(&(pose * block.centre).coords, reach_m(block)));
        boxes.reduce(|a, b| a.joined(&b)).unwrap_or_else(|| Extent::of(std::iter::empty()))
    }

    /// Tiles that a station saw, ascending.
    pub(crate) fn seen(&self, station: usize) -> impl Iterator<Item = usize> + '_ {
        let sums: &Sums = &self.adjusted.sums[station];
        (0..sums.tiles()).filter(|slot| sums.count(*slot) >= FEWEST_POINTS).map(|slot| sums.tile(slot))
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
        for (ends, _) in pairs(self.adjusted) {
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
            for (ends, tiles) in pairs(self.adjusted) {
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

/// Pairs of stations with enough tiles in common.
fn pairs(adjusted: &Adjusted) -> impl Iterator<Item = ([usize; 2], usize)> + '_ {
    let pairs = adjusted.common.pairs.iter().filter(|(_, tiles)| tiles.len() >= FEWEST_CONTACTS);
    pairs.map(|(&(a, b), tiles)| ([a as usize, b as usize], tiles.len()))
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
