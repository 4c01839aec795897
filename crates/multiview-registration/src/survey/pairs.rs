//! Two stations by themselves, from the tiles that both saw.

use nalgebra::{DVector, Isometry3, Matrix6};
use rayon::prelude::*;

use crate::adjustment::equations::Equations;
use crate::adjustment::network::{Network, State};
use crate::adjustment::precision;
use crate::adjustment::simultaneous::Adjusted;
use crate::agreement::alignments::{Overlap, PairAlignment};
use crate::error::Result;
use crate::planes::elimination::SharedPlaneSums;
use crate::planes::scatter::TileMean;
use icp_registration::{IcpResult, StopReason};
use rigid_pose::{step_pose, symmetrised};

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
        let mut found = Vec::new();
        for (shared_plane, means) in self.means.iter().enumerate() {
            for tile in means.chunk_by(|a, b| a.tile == b.tile) {
                let of = |station: usize| tile.iter().find(|mean| mean.station == station).copied();
                if let (Some(target), Some(source)) = (of(target), of(source)) {
                    found.push(SharedTile { shared_plane, target, source });
                }
            }
        }
        found
    }

    /// Part of the tiles of each station that each other one saw too, for pairs that share as many tiles as needed.
    pub(crate) fn overlaps(&self, fewest: usize) -> Vec<Overlap> {
        let count = self.state.poses.len();
        let (mut seen, mut shared) = (vec![0_usize; count], vec![0_usize; count * count]);
        for tile in self.means.iter().flat_map(|means| means.chunk_by(|a, b| a.tile == b.tile)) {
            for (k, first) in tile.iter().enumerate() {
                seen[first.station] += 1;
                tile[k + 1..].iter().for_each(|second| shared[first.station * count + second.station] += 1);
            }
        }
        let pairs = (0..count).flat_map(|target| (target + 1..count).map(move |source| (target, source)));
        let enough = pairs.filter(|(target, source)| shared[target * count + source] >= fewest.max(1));
        let overlap = |(target, source): (usize, usize)| {
            let fraction = shared[target * count + source] as f64 / seen[source] as f64;
            Overlap { source, target, fraction }
        };
        enough.map(overlap).collect()
    }

    /// The poses of pairs if nothing but the two stations had been there.
    pub(crate) fn pairs(&self, pairs: &[(usize, usize)], hold_m: f64, size_m: f64) -> Result<Vec<PairAlignment>> {
        pairs.par_iter().map(|&(target, source)| self.pair(target, source, hold_m, size_m)).collect()
    }

    fn pair(&self, target: usize, source: usize, hold_m: f64, size_m: f64) -> Result<PairAlignment> {
        let poses = [self.state.poses[target], self.state.poses[source]];
        let none = (Vec::new(), Vec::new());
        let network = Network { fixed: 0, hold_m, turn_rad: 1.0, names: &[], prior: &none, turns: &[] };
        let mut equations = Equations::new(2, 0);
        for ((shared_plane, variances), means) in self.shared_planes.iter().zip(&self.variances).zip(&self.means) {
            let sees = |station: usize| means.iter().any(|mean| mean.station == station);
            if !(sees(target) && sees(source)) {
                continue;
            }
            let seen = SharedPlaneSums { shared_plane, sums: &self.sums, weights: &self.scatter.weights };
            if let Some(mut eliminated) = seen.eliminated(&[target, source], *variances) {
                eliminated.rename(&[target, source]);
                equations.add(shared_plane, &eliminated, &poses);
            }
        }
        let state = State { poses: poses.to_vec(), parameters: Vec::new() };
        // Along a weak direction the pair stays where all stations have it: there the tiles would be others.
        let (step, _) = equations.solved(&network.near(size_m / 2.0), &state)?;
        let (_, cofactors) = equations.solved(&network, &state)?;
        let moved = step_pose(&poses[1], &step.fixed_rows::<6>(6).into_owned());
        let result = self.result(target, source, poses[0].inverse() * moved, size_m);
        let to_target = poses[0].rotation.inverse().to_rotation_matrix().into_inner();
        let mut turn = Matrix6::identity();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&to_target);
        let covariance =
            symmetrised(&(turn * cofactors.fixed_view::<6, 6>(6, 6) * turn.transpose())) * self.variance_factor();
        let degenerate = precision::undetermined(&result.target_from_source, &covariance, hold_m, size_m);
        Ok(PairAlignment { target, source, result: IcpResult { covariance, degenerate, ..result } })
    }

    fn result(&self, target: usize, source: usize, target_from_source: Isometry3<f64>, size_m: f64) -> IcpResult {
        let shared = self.shared(target, source);
        let seen = self.means.iter().flatten().filter(|mean| mean.station == source).count();
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
