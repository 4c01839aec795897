//! Whether stations looked through what others saw, as fine as pixels: what stands at the wrong place by less than a tile is still in
//! the way of rays that pass it.

use nalgebra::{Isometry3, Point3};
use rayon::prelude::*;

use crate::verification::free_space::FreeSpace;

/// Of ten stations, in the order of what contradicts them, the one that shows what is usual; fewer points show nothing; and how many times
/// that a station is doubted from. In buildings of 400 stations in their places have up to three times as much, one 4 cm off fourteen times.
const USUAL_AT: usize = 8;
const LEAST_USUAL: usize = 25;
const DOUBTED: usize = 4;

/// What a station looked through, and points of what it saw, those that are surely no gross errors.
#[derive(Debug, Clone)]
pub struct Look {
    /// The space between the station and what it saw.
    pub space: FreeSpace,
    /// In the frame of the station, metre.
    pub seen: Vec<Point3<f64>>,
}

/// What stations looked through, and what they saw.
#[derive(Debug, Clone)]
pub struct LookedThrough {
    looks: Vec<Look>,
    /// The stations that each is held against.
    beside: Vec<Vec<usize>>,
}

impl LookedThrough {
    /// `pairs`: stations that see something in common.
    pub fn new(looks: Vec<Look>, pairs: impl Iterator<Item = [usize; 2]>) -> Self {
        let mut beside = vec![Vec::new(); looks.len()];
        for [a, b] in pairs {
            beside[a].push(b);
            beside[b].push(a);
        }
        Self { looks, beside }
    }

    /// The stations that one is held against.
    pub fn beside(&self, station: usize) -> &[usize] {
        &self.beside[station]
    }

    /// Stations in places where rays went through what others saw far more often than is usual. The worst is taken out again and again: it
    /// makes those beside it look wrong.
    pub fn doubtful(&self, poses: &[Isometry3<f64>]) -> Vec<usize> {
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
    pub fn contradictions(&self, station: usize, pose: &Isometry3<f64>, poses: &[Isometry3<f64>]) -> usize {
        let with = |&other: &usize| self.between(station, other, &(poses[other].inverse() * pose));
        self.beside[station].iter().map(with).sum()
    }

    /// Points of either of two stations that the other looked through.
    pub fn between(&self, station: usize, other: usize, other_from_station: &Isometry3<f64>) -> usize {
        let through = |by: usize, from: usize, motion: &Isometry3<f64>| {
            self.looks[from].seen.iter().filter(|point| self.looks[by].space.holds(&(motion * **point))).count()
        };
        through(other, station, other_from_station) + through(station, other, &other_from_station.inverse())
    }
}
