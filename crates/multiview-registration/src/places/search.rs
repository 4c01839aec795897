//! Whether stations would fit better in another place: slid along what their surfaces tell least, among the planes that the others saw.
//!
//! Where little stands along a wall, the patches of the wide rounds may leave a station decimetres from its place, or all those beyond
//! it, and shared planes that are not met there pull them no more. But their points tell: in the right place more of them lie on what
//! the others saw.
use std::collections::BTreeSet;

use global_registration::{FreeSpace, Look, LookedThrough};
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::adjustment::known::Known;
use crate::adjustment::network::Network;
use crate::adjustment::rounds::FEWEST_CONTACTS;
use crate::adjustment::simultaneous::Adjusted;
use crate::error::Result;
use crate::places::sought::Sought;
use crate::planes::elimination::FEWEST_POINTS;
use crate::planes::sightings::{APART, Gate, NOWHERE, Sighting, Wide, members};
use crate::planes::sums::Sums;
use crate::relative_pose::RelativePose;
use crate::surfaces::points::StationPoints;

/// Of so many points that lie on planes one is held against the rays of others.
pub(crate) const RAY_STRIDE: usize = 8;
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
        let known_m = Known::estimated(start, &adjusted.state.poses, (size_m, reach_m), network.hold_m).position_m;
        let gate = Gate { slack_m: 0.0, stride: 1, parameters: 0 };
        let look = |station: usize| {
            let (points, pose) = (&points[station], &adjusted.state.poses[station]);
            let free_to = |(point, sigma): (&Point3<f64>, &f64)| (*point, point.coords.norm() - APART * sigma);
            let space = FreeSpace::new(&points.points.iter().zip(&points.sigma).map(free_to).collect::<Vec<_>>());
            let tiles = Sighting::new(points, pose, planes, gate).sums_and_tiles(&wide, &members[station]).1;
            let on_planes = points.points.iter().zip(tiles).filter(|(_, tile)| *tile != NOWHERE);
            Look { space, seen: on_planes.map(|(point, _)| *point).step_by(RAY_STRIDE).collect() }
        };
        let looks: Vec<Look> = (0..points.len()).into_par_iter().map(look).collect();
        let looked_through = LookedThrough::new(looks, pairs(adjusted));
        Self { adjusted, points, network, start, size_m, known_m, reach_m, wide, members, looked_through }
    }

    /// Moves stations to where they fit better; returns which, and whether joints are known better. `last`: those that have moved since all
    /// were looked at; others that see nothing of them stay.
    pub(crate) fn improved(
        &self,
        poses: &mut [Isometry3<f64>],
        joints: &mut Vec<RelativePose>,
        last: Option<&BTreeSet<usize>>,
    ) -> Result<(BTreeSet<usize>, bool)> {
        let tiles = self.adjusted.shared_planes.last().map_or(0, |plane| plane.tiles.first + plane.tiles.len());
        let mut by = vec![0; tiles];
        for tile in (0..poses.len()).flat_map(|station| self.seen(station)) {
            by[tile] += 1;
        }
        let (mut moved, is_new) = self.joined(poses, joints)?;
        let of_one = |station: usize| -> Result<Option<(usize, Isometry3<f64>)>> {
            // What it alone saw says nothing.
            let own: Vec<usize> = self.seen(station).collect();
            let by_others = |tile: usize| by[tile] > u32::from(own.binary_search(&tile).is_ok());
            let better = Sought::new(self, station, poses, &by_others).better(poses)?;
            Ok(better.map(|motion| (station, motion)))
        };
        let may_move = |station: usize| {
            let mut about = self.looked_through.beside(station).iter().chain([&station]);
            !moved.contains(&station) && last.is_none_or(|last| about.any(|other| last.contains(other)))
        };
        let single = (0..poses.len()).into_par_iter().filter(|station| may_move(*station));
        let better: Vec<_> = single.map(of_one).collect::<Result<_>>()?;
        for (station, motion) in better.into_iter().flatten() {
            move_by(&motion, &mut poses[station]);
            moved.insert(station);
        }
        Ok((moved, is_new))
    }

    /// Tiles that a station saw, ascending.
    pub(crate) fn seen(&self, station: usize) -> impl Iterator<Item = usize> + '_ {
        let sums: &Sums = &self.adjusted.sums[station];
        (0..sums.tiles()).filter(|slot| sums.count(*slot) >= FEWEST_POINTS).map(|slot| sums.tile(slot))
    }
}

/// Pairs of stations with enough tiles in common.
pub(crate) fn pairs(adjusted: &Adjusted) -> impl Iterator<Item = [usize; 2]> + '_ {
    let pairs = adjusted.common.pairs.iter().filter(|(_, tiles)| tiles.len() >= FEWEST_CONTACTS);
    pairs.map(|(&(a, b), _)| [a as usize, b as usize])
}

pub(crate) fn move_by(motion: &Isometry3<f64>, pose: &mut Isometry3<f64>) {
    *pose = motion * *pose;
    pose.rotation.renormalize();
}
