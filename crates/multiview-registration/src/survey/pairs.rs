//! Two stations by themselves, from the tiles that both saw, and how loops of such pairs close.

use nalgebra::{DVector, Isometry3, Matrix6};
use rayon::prelude::*;

use crate::adjustment::equations::Equations;
use crate::adjustment::known::Known;
use crate::adjustment::precision;
use crate::adjustment::rounds::FEWEST_CONTACTS;
use crate::adjustment::simultaneous::Adjusted;
use crate::agreement::alignments::{Overlap, PairAlignment, best_partners};
use crate::agreement::loops::{LoopClosure, spanning_tree};
use crate::error::Result;
use crate::planes::elimination::SharedPlaneSums;
use crate::planes::scatter::TileMean;
use icp_registration::{IcpResult, StopReason};
use rigid_pose::{step_pose, symmetrised};

/// Partners that each station is held against by itself, those with the most overlap.
const PARTNERS: usize = 3;

/// A tile that two stations saw.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SharedTile {
    pub shared_plane: usize,
    pub target: TileMean,
    pub source: TileMean,
}

impl SharedTile {
    /// Distance of the source's points before those of the target along the normal of the shared plane, metre.
    pub(crate) fn apart_m(&self) -> f64 {
        self.source.mean_m - self.target.mean_m
    }

    /// One over the variance of that distance.
    pub(crate) fn weight(&self) -> f64 {
        1.0 / (1.0 / self.source.weight + 1.0 / self.target.weight)
    }
}

impl Adjusted {
    /// The tiles that both stations saw.
    pub(crate) fn shared(&self, target: usize, source: usize) -> Vec<SharedTile> {
        let common = self.common.pairs.get(&(target.min(source) as u32, target.max(source) as u32));
        let tile = |&[plane, first, second]: &[u32; 3]| {
            let means = &self.means[plane as usize];
            let (first, second) = (means[first as usize], means[second as usize]);
            let (target, source) = if target < source { (first, second) } else { (second, first) };
            SharedTile { shared_plane: plane as usize, target, source }
        };
        common.map_or_else(Vec::new, |tiles| tiles.iter().map(tile).collect())
    }

    /// Part of the tiles of each station that each other one saw too, for pairs that share as many tiles as needed.
    pub(crate) fn overlaps(&self, fewest: usize) -> Vec<Overlap> {
        let enough = self.common.pairs.iter().filter(|(_, tiles)| tiles.len() >= fewest.max(1));
        let overlap = |(&(target, source), tiles): (&(u32, u32), &Vec<[u32; 3]>)| {
            let (target, source) = (target as usize, source as usize);
            Overlap { source, target, fraction: tiles.len() as f64 / self.common.tiles[source] as f64 }
        };
        enough.map(overlap).collect()
    }

    /// The poses of the pairs with the most overlap if nothing but the two stations had been there, and how their loops close.
    pub(crate) fn alone(
        &self,
        minimum_overlap: f64,
        held: usize,
        (hold_m, size_m): (f64, f64),
    ) -> Result<(Vec<PairAlignment>, Vec<LoopClosure>)> {
        let count = self.state.poses.len();
        let chosen = best_partners(&self.overlaps(FEWEST_CONTACTS), count, minimum_overlap, PARTNERS);
        let pairs = chosen.par_iter().map(|&(target, source)| self.pair(target, source, hold_m, size_m));
        let pairs = pairs.collect::<Result<Vec<_>>>()?;
        let loops = spanning_tree(&pairs, held, count).loops;
        Ok((pairs, loops))
    }

    fn pair(&self, target: usize, source: usize, hold_m: f64, size_m: f64) -> Result<PairAlignment> {
        let poses = [self.state.poses[target], self.state.poses[source]];
        let mut equations = Equations::new(2, Some(0), 0, 0);
        let also = &self.common.planes[source];
        for &plane in self.common.planes[target].iter().filter(|plane| also.binary_search(plane).is_ok()) {
            let (shared_plane, variances) = (&self.shared_planes[plane as usize], self.variances[plane as usize]);
            let seen = SharedPlaneSums { shared_plane, sums: &self.sums, weights: Some(&self.scatter.weights) };
            if let Some(mut eliminated) = seen.eliminated(&[target, source], variances, usize::MAX) {
                eliminated.rename(&[target, source]);
                equations.add(shared_plane, &eliminated, &poses);
            }
        }
        // Along a weak direction the pair stays where all stations have it: there the tiles would be others.
        let step = equations.step(&equations.cofactors(Known::at(size_m / 2.0, hold_m))?);
        let cofactors = equations.cofactors(Known::at(hold_m, hold_m))?;
        let moved = step_pose(&poses[1], &step.fixed_rows::<6>(6).into_owned());
        let result = self.result(target, source, poses[0].inverse() * moved, size_m);
        let to_target = poses[0].rotation.inverse().to_rotation_matrix().into_inner();
        let mut turn = Matrix6::identity();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&to_target);
        let covariance = symmetrised(&(turn * cofactors.of(1) * turn.transpose())) * self.factor;
        let degenerate = precision::undetermined(&result.target_from_source, &covariance, hold_m, size_m);
        Ok(PairAlignment { target, source, result: IcpResult { covariance, degenerate, ..result } })
    }

    fn result(&self, target: usize, source: usize, target_from_source: Isometry3<f64>, size_m: f64) -> IcpResult {
        let shared = self.shared(target, source);
        let seen = self.common.tiles[source];
        let squares = DVector::from_iterator(shared.len(), shared.iter().map(|s| s.weight() * s.apart_m().powi(2)));
        let weight: f64 = shared.iter().map(SharedTile::weight).sum();
        IcpResult {
            target_from_source,
            covariance: Matrix6::zeros(),
            overlap: shared.len() as f64 / seen.max(1) as f64,
            rms_m: if weight > 0.0 { (squares.sum() / weight).sqrt() } else { 0.0 },
            iterations: self.rounds,
            stop: if self.settled { StopReason::Converged } else { StopReason::WithinNoise },
            correspondences: shared.len(),
            max_correspondence_distance_m: size_m / 2.0,
            degenerate: Vec::new(),
        }
    }
}
