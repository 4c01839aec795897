//! The last rounds: all points of all stations on facets whose planes are unknown too.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Vector6};
use rayon::prelude::*;

use super::contacts::{IN_PLACE, Reach};
use super::elimination::{Eliminated, FacetSums, motion_of};
use super::equations::Equations;
use super::facets::{Facet, facets};
use super::network::{Network, State, largest_step};
use super::points::StationPoints;
use super::rounds::{Surfaces, meet};
use super::scatter::{Scatter, TileMean, between, roughness, tile_means};
use super::shared_errors::SharedErrors;
use super::sightings::{Gate, sightings};
use super::sums::Sums;
use super::wide_errors::WideErrors;
use crate::error::Result;
use crate::kernel::RobustKernel;
use crate::pose::{pose_difference, step_pose};

/// What the poses may be off in the first rounds, patches: facets are joined anew from better poses.
const OFF: [f64; 2] = [0.06, 0.01];

/// Of so many points one is taken in the first round, which need not be better than the contacts of patches.
const FIRST_STRIDE: usize = 3;

/// Part of its standard deviation by which a station may still move, all six components together: a twelfth in each.
const FEW_SIGMAS: f64 = 0.2;

/// What the last round leaves.
pub(super) struct Adjusted {
    pub state: State,
    pub facets: Vec<Facet>,
    pub sums: Vec<Sums>,
    pub scatter: Scatter,
    /// Of the tiles of each facet that two stations or more saw.
    pub means: Vec<Vec<TileMean>>,
    /// Variance of the surface of a tile about the plane of each facet, metre².
    pub roughness: Vec<f64>,
    pub wide: WideErrors,
    /// Of all unknowns, zero for the station that is held.
    pub covariance: DMatrix<f64>,
    pub rounds: usize,
    pub settled: bool,
}

impl Adjusted {
    /// Differences between stations within tiles less unknowns.
    pub(super) fn redundancy(&self) -> i64 {
        let unknowns = self.covariance.nrows() as i64 - 6;
        self.scatter.differences.round() as i64 - unknowns
    }

    /// Standard deviation of unit weight of what stations saw of the same tiles; `None` without redundancy.
    pub(super) fn sigma0(&self) -> Option<f64> {
        let redundancy = self.redundancy();
        (redundancy > 0).then(|| (self.scatter.squares / redundancy as f64).sqrt())
    }
}

/// How the rounds go.
pub(super) struct Finish<'a> {
    pub network: &'a Network<'a>,
    /// The same with poses held at what the rounds start from: along a direction that the surfaces leave open, facets
    /// farther off would be others.
    pub near: Network<'a>,
    pub kernel: RobustKernel,
    pub max_rounds: usize,
    /// Movement at which the rounds end, metre.
    pub tolerance_m: f64,
    pub minimum_contacts: usize,
    pub progress: &'a (dyn Fn(usize) + Sync),
}

impl Finish<'_> {
    /// Adjusts all stations from poses that are right to a part of a patch.
    pub(super) fn run(
        &self,
        surfaces: &mut Surfaces<'_>,
        points: &mut [StationPoints],
        mut state: State,
    ) -> Result<Adjusted> {
        let size_m = surfaces.given.iter().map(|surface| surface.size_m).fold(0.0, f64::max);
        let (mut known, mut errors, mut steps, mut round) = (Vec::new(), SharedErrors::default(), Vec::new(), 0);
        loop {
            surfaces.update(&state.parameters)?;
            surfaces.place(points, &state.parameters)?;
            let scene = surfaces.scene(0);
            let off_m = OFF.get(round).map(|off| off * size_m);
            if let Some(off_m) = off_m {
                let count = state.poses.len();
                let all: Vec<(usize, usize)> = (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).collect();
                let reach = Reach { across_m: size_m / 4.0, candidates: 1, cosine: IN_PLACE };
                let meetings = meet(&scene.surfaces, &state.poses, &all, reach, self.minimum_contacts)?;
                if round == 0 {
                    errors = SharedErrors::of_contacts(scene.distances(&meetings, &state.poses));
                }
                known = facets(&scene.surfaces, &state.poses, &meetings, (off_m, errors.total()));
            }
            let first = round == 0;
            let (slack_m, stride) = if first { (OFF[0] * size_m, FIRST_STRIDE) } else { (0.0, 1) };
            let gate = Gate {
                kernel: self.kernel,
                slack_m,
                stride,
                parameters: state.parameters.len(),
                shared: errors.total(),
            };
            let sums = sightings(points, &state.poses, &known, gate);
            let before = state.clone();
            let adjusted = self.step(&mut state, &mut known, sums, &errors)?;
            errors = adjusted.scatter.errors.clone();
            steps = halved(&before, &mut state, &steps, self.network.hold_m);
            round += 1;
            (self.progress)(round);
            let settled = off_m.is_none() && self.is_settled(&before, &state, &adjusted.covariance);
            if settled || round >= self.max_rounds.max(OFF.len() + 1) {
                return Ok(Adjusted { state, facets: known, rounds: round, settled, ..adjusted });
            }
        }
    }

    /// Whether every station moved by less than the tolerance, or by so little of its standard deviation that further
    /// rounds tell nothing: along a direction that the surfaces leave open, poses drift with every change of weights.
    fn is_settled(&self, before: &State, after: &State, covariance: &DMatrix<f64>) -> bool {
        if largest_step(before, after, self.network.hold_m) <= self.tolerance_m {
            return true;
        }
        before.poses.iter().zip(&after.poses).enumerate().all(|(k, (a, b))| {
            let step = pose_difference(a, b);
            let own = covariance.fixed_view::<6, 6>(6 * k, 6 * k).into_owned();
            let sigmas = own.cholesky().map_or(f64::INFINITY, |factor| step.dot(&factor.solve(&step)).sqrt());
            k == self.network.fixed || sigmas <= FEW_SIGMAS
        })
    }

    /// What the stations saw of each tile about the planes at the present poses, and how that scatters.
    fn scatter(
        &self,
        known: &[Facet],
        sums: &[Sums],
        state: &State,
        errors: &SharedErrors,
    ) -> (Vec<Vec<TileMean>>, Scatter) {
        let tiles = known.iter().map(|facet| facet.tiles.len()).sum();
        let count = state.poses.len();
        let stations: Vec<usize> = (0..count).collect();
        let (ones, none) = (vec![1.0; tiles * count], vec![0.0; tiles * count]);
        let of_facet = |(index, facet): (usize, &Facet)| {
            let seen = FacetSums { facet, sums, weights: &ones, shared: &none, roughness: 0.0 };
            let eliminated = seen.eliminated(&stations);
            eliminated.map_or_else(Vec::new, |eliminated| tile_means(&seen, &eliminated, (index as u32, &state.poses)))
        };
        let mut means: Vec<Vec<TileMean>> = known.par_iter().enumerate().map(of_facet).collect();
        let unknowns = (6 * (count - 1) + state.parameters.len()) as f64;
        let scatter = between(&mut means, (count, tiles), self.kernel, errors, unknowns);
        (means, scatter)
    }

    /// One linearised step of all unknowns.
    fn step(&self, state: &mut State, known: &mut [Facet], sums: Vec<Sums>, errors: &SharedErrors) -> Result<Adjusted> {
        let stations: Vec<usize> = (0..state.poses.len()).collect();
        let (means, scatter) = self.scatter(known, &sums, state, errors);
        let Scatter { weights, shared, .. } = &scatter;
        let of_mean = |mean: &TileMean| shared[mean.tile * stations.len() + mean.station];
        let roughness: Vec<f64> = means.par_iter().map(|means| roughness(means, of_mean)).collect();
        let parameters = state.parameters.len();
        let equations_of = |shared: &[f64], roughness: &[f64]| {
            let eliminated: Vec<Option<Eliminated>> = (0..known.len())
                .into_par_iter()
                .map(|k| {
                    let seen = FacetSums { facet: &known[k], sums: &sums, weights, shared, roughness: roughness[k] };
                    seen.eliminated(&stations)
                })
                .collect();
            let mut equations = Equations::new(state.poses.len(), parameters);
            for (facet, eliminated) in known.iter().zip(&eliminated) {
                if let Some(eliminated) = eliminated {
                    equations.add(facet, eliminated, &state.poses);
                }
            }
            (equations, eliminated)
        };
        let (equations, eliminated) = equations_of(shared, &roughness);
        let (step, _) = equations.solved(&self.near, state)?;
        let (_, mut covariance) = equations.solved(self.network, state)?;
        if !scatter.errors.is_local() {
            let mut answers = BTreeMap::new();
            for (k, eliminated) in eliminated.iter().enumerate() {
                let Some(eliminated) = eliminated else { continue };
                let seen = FacetSums { facet: &known[k], sums: &sums, weights, shared, roughness: roughness[k] };
                for (cell, right) in seen.answers(eliminated, &means[k]) {
                    let all = answers.entry(cell).or_insert_with(|| DVector::zeros(equations.right.len()));
                    equations.add_right(&known[k], (eliminated, &right), &state.poses, all);
                }
            }
            let bent = scatter.errors.bent(&answers, &covariance);
            covariance += bent;
        }
        let unknowns = (equations.right.len() - 6) as f64;
        let wide = WideErrors::new(known, &means, &scatter, unknowns);
        let (_, cofactors) = equations_of(&wide.shared, &wide.roughness).0.solved(self.network, state)?;
        // From three stations on, products of differences tell what neighbouring places share.
        let covariance = if state.poses.len() > 2 { covariance } else { wide.at_least(covariance, &cofactors)? };
        for (facet, eliminated) in known.iter_mut().zip(&eliminated) {
            if let Some(eliminated) = eliminated {
                let motions = motions(facet, eliminated, &state.poses, &step);
                facet.moved(&eliminated.plane(&motions));
            }
        }
        for (k, pose) in state.poses.iter_mut().enumerate() {
            *pose = step_pose(pose, &step.fixed_rows::<6>(6 * k).into_owned());
        }
        let shared = step.rows(6 * state.poses.len(), parameters);
        state.parameters.iter_mut().zip(shared.iter()).for_each(|(value, step)| *value += step);
        let state = state.clone();
        Ok(Adjusted {
            state,
            facets: Vec::new(),
            sums,
            scatter,
            means,
            roughness,
            wide,
            covariance,
            rounds: 0,
            settled: false,
        })
    }
}

/// Halves the steps that lead back: points that change facets with the pose of a station may throw it to and fro. Gives the
/// steps, rotations as lengths.
fn halved(before: &State, after: &mut State, last: &[Vector6<f64>], radius_m: f64) -> Vec<Vector6<f64>> {
    let mut steps = Vec::with_capacity(after.poses.len());
    for (k, (from, to)) in before.poses.iter().zip(&mut after.poses).enumerate() {
        let mut step = pose_difference(from, to);
        let lengths = |step: &Vector6<f64>| Vector6::from_fn(|i, _| if i < 3 { step[i] } else { step[i] * radius_m });
        if last.get(k).is_some_and(|last| last.dot(&lengths(&step)) < 0.0) {
            step *= 0.5;
            *to = step_pose(from, &step);
        }
        steps.push(lengths(&step));
    }
    steps
}

/// Motions of a facet's points with a step of all unknowns.
fn motions(facet: &Facet, eliminated: &Eliminated, poses: &[Isometry3<f64>], step: &DVector<f64>) -> DVector<f64> {
    let mut motions = DVector::zeros(eliminated.right.len());
    for (k, &station) in eliminated.stations.iter().enumerate() {
        let motion = motion_of(facet, &poses[station]).transpose() * step.fixed_rows::<6>(6 * station);
        motions.fixed_rows_mut::<3>(3 * k).copy_from(&motion);
    }
    let (of_motions, of_poses) = (3 * eliminated.stations.len(), 6 * poses.len());
    for k in of_motions..motions.len() {
        motions[k] = step[of_poses + k - of_motions];
    }
    motions
}
