//! Whether stations looked through what others saw, as fine as pixels: what stands at the wrong place by less than a tile is still in
//! the way of rays that pass it.

use global_registration::FreeSpace;
use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::planes::sightings::NOWHERE;
use crate::surfaces::points::StationPoints;

/// Of so many points that lie on planes one is looked at.
const STRIDE: usize = 8;
/// Standard deviations before a point up to which its ray is free.
const BEFORE: f64 = 7.0;

/// Of ten stations, in the order of what contradicts them, the one that shows what is usual; fewer points show nothing; and how many times
/// that a station is doubted from. In buildings of 400 stations in their places have up to three times as much, one 4 cm off fourteen times.
const USUAL_AT: usize = 8;
const LEAST_USUAL: usize = 25;
const DOUBTED: usize = 4;

/// What stations looked through, and what they saw.
pub(crate) struct LookedThrough {
    spaces: Vec<FreeSpace>,
    /// Points on planes, those that are surely no gross errors.
    seen: Vec<Vec<Point3<f64>>>,
    /// The stations that each has tiles in common with.
    beside: Vec<Vec<usize>>,
}

impl LookedThrough {
    /// `tiles`: the tile that each point of each station lies on.
    pub(crate) fn new(points: &[StationPoints], tiles: &[Vec<u32>], pairs: impl Iterator<Item = [usize; 2]>) -> Self {
        let space = |points: &StationPoints| {
            let free_to = |(point, sigma): (&Point3<f64>, &f64)| (*point, point.coords.norm() - BEFORE * sigma);
            FreeSpace::new(&points.points.iter().zip(&points.sigma).map(free_to).collect::<Vec<_>>())
        };
        let of_station = |(points, tiles): (&StationPoints, &Vec<u32>)| {
            let on_planes = points.points.iter().zip(tiles).filter(|(_, tile)| **tile != NOWHERE);
            on_planes.map(|(point, _)| *point).step_by(STRIDE).collect()
        };
        let mut beside = vec![Vec::new(); points.len()];
        for [a, b] in pairs {
            beside[a].push(b);
            beside[b].push(a);
        }
        let seen = points.iter().zip(tiles).map(of_station).collect();
        Self { spaces: points.par_iter().map(space).collect(), seen, beside }
    }

    /// Stations in places where rays went through what others saw far more often than is usual. The worst is taken out again and again: it
    /// makes those beside it look wrong.
    pub(crate) fn doubtful(&self, poses: &[Isometry3<f64>]) -> Vec<usize> {
        let of_one = |station: usize| -> Vec<(usize, usize)> {
            let with =
                |&other: &usize| (other, self.between(station, other, &(poses[other].inverse() * poses[station])));
            self.beside[station].iter().map(with).collect()
        };
        let pairs: Vec<Vec<(usize, usize)>> = (0..poses.len()).into_par_iter().map(of_one).collect();
        let mut sums: Vec<usize> = pairs.iter().map(|own| own.iter().map(|(_, count)| count).sum()).collect();
        let mut sorted = sums.clone();
        sorted.sort_unstable();
        let usual = sorted.get(USUAL_AT * sorted.len() / 10).map_or(0, |sum| *sum).max(LEAST_USUAL);
        let mut doubtful = Vec::new();
        while let Some(worst) = (0..sums.len()).max_by_key(|station| sums[*station]) {
            if sums[worst] < DOUBTED * usual {
                break;
            }
            doubtful.push(worst);
            for &(other, count) in &pairs[worst] {
                sums[other] = sums[other].saturating_sub(count);
            }
            sums[worst] = 0;
        }
        doubtful
    }

    /// Points of a station at a pose that the others looked through, and points of theirs that it looked through.
    pub(crate) fn contradictions(&self, station: usize, pose: &Isometry3<f64>, poses: &[Isometry3<f64>]) -> usize {
        let with = |&other: &usize| self.between(station, other, &(poses[other].inverse() * pose));
        self.beside[station].iter().map(with).sum()
    }

    /// Points of either of two stations that the other looked through.
    fn between(&self, station: usize, other: usize, other_from_station: &Isometry3<f64>) -> usize {
        let through = |by: usize, from: usize, motion: &Isometry3<f64>| {
            self.seen[from].iter().filter(|point| self.spaces[by].holds(&(motion * **point))).count()
        };
        through(other, station, other_from_station) + through(station, other, &other_from_station.inverse())
    }
}
