//! The last rounds: all points of all stations on shared planes whose planes are unknown too.

use nalgebra::{DMatrix, DVector, Isometry3};
use rayon::prelude::*;

use crate::adjustment::equations::Equations;
use crate::adjustment::network::{Network, State, largest_step};
use crate::adjustment::rounds::{Surfaces, meet};
use crate::error::Result;
use crate::planes::contacts::Reach;
use crate::planes::elimination::{Eliminated, SharedPlaneSums, Variances, motion_of};
use crate::planes::scatter::{Scatter, TileMean, between, tile_means, variances};
use crate::planes::shared_planes::{SharedPlane, shared_planes};
use crate::planes::sightings::{Gate, sightings};
use crate::planes::sums::Sums;
use crate::planes::wide_errors::Residuals;
use crate::surfaces::plane_fit::SAME_DIRECTION;
use crate::surfaces::points::StationPoints;
use icp_registration::RobustKernel;
use rigid_pose::{pose_difference, step_pose};

/// What the poses may be off in the first rounds, patches: shared planes are joined anew from better poses.
const OFF: [f64; 2] = [0.06, 0.01];

/// Of so many points one is taken in the first round, which need not be better than the contacts of patches.
const FIRST_STRIDE: usize = 3;

/// Most rounds, each with points given to the surfaces anew; most surveys are settled after four or five.
pub(crate) const MOST_ROUNDS: usize = 12;
/// For single points and for what a station saw of a tile: what is no common surface has no weight.
const KERNEL: RobustKernel = RobustKernel::Tukey;
/// Part of its standard deviation by which a station may still move.
const FEW_SIGMAS: f64 = 0.1;

/// What the last round leaves.
pub(crate) struct Adjusted {
    pub state: State,
    pub shared_planes: Vec<SharedPlane>,
    pub sums: Vec<Sums>,
    pub scatter: Scatter,
    /// Of the tiles of each shared plane that two stations or more saw.
    pub means: Vec<Vec<TileMean>>,
    pub variances: Vec<Variances>,
    /// Inverse of the normal matrix, zero for the station that is held.
    pub cofactors: DMatrix<f64>,
    /// Factor of the cofactors that makes covariances of them.
    pub factor: f64,
    pub rounds: usize,
    pub settled: bool,
}

impl Adjusted {
    /// Differences between stations within tiles less unknowns.
    pub(crate) fn redundancy(&self) -> i64 {
        let unknowns = self.cofactors.nrows() as i64 - 6;
        self.scatter.differences.round() as i64 - unknowns
    }

    /// Standard deviation of unit weight of what stations saw of the same tiles; `None` without redundancy.
    pub(crate) fn sigma0(&self) -> Option<f64> {
        let redundancy = self.redundancy();
        (redundancy > 0).then(|| (self.scatter.squares / redundancy as f64).sqrt())
    }

    /// Factor of the covariance: what tiles scatter beyond the noise of their points is not independent from tile to tile,
    /// and so more than the weights that it takes from them; errors that whole shared planes share are more still.
    pub(crate) fn variance_factor(&self) -> f64 {
        self.factor
    }

    fn factor_on(&self, shared_planes: &[SharedPlane]) -> f64 {
        let of_tiles = self.sigma0().map_or(1.0, |sigma0| sigma0.powi(2).max(1.0));
        let residuals = Residuals {
            shared_planes,
            means: &self.means,
            scatter: &self.scatter,
            sums: &self.sums,
            poses: &self.state.poses,
            cofactors: &self.cofactors,
            of_tiles,
        };
        residuals.factor()
    }
}

/// How the rounds go.
pub(crate) struct Finish<'a> {
    pub network: &'a Network<'a>,
    /// The same with poses held at what the rounds start from: along a direction that the surfaces leave open, shared planes
    /// farther off would be others.
    pub near: Network<'a>,
    /// Movement at which the rounds end, metre.
    pub tolerance_m: f64,
    pub progress: &'a (dyn Fn(usize) + Sync),
}

impl Finish<'_> {
    /// Adjusts all stations from poses that are right to a part of a patch.
    pub(crate) fn run(
        &self,
        surfaces: &mut Surfaces<'_>,
        points: &mut [StationPoints],
        mut state: State,
    ) -> Result<Adjusted> {
        let size_m = surfaces.given.iter().map(|surface| surface.size_m).fold(0.0, f64::max);
        let (mut known, mut round) = (Vec::new(), 0);
        loop {
            surfaces.update(&state.parameters)?;
            surfaces.place(points, &state.parameters)?;
            let scene = surfaces.scene(0);
            let off_m = OFF.get(round).map(|off| off * size_m);
            if let Some(off_m) = off_m {
                let count = state.poses.len();
                let all: Vec<(usize, usize)> = (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).collect();
                let reach = Reach { across_m: size_m / 4.0, candidates: 1, cosine: SAME_DIRECTION };
                let pairs_in_contact = meet(&scene.surfaces, &state.poses, &all, reach)?;
                known = shared_planes(&scene.surfaces, &state.poses, &pairs_in_contact, off_m);
            }
            let first = round == 0;
            let (slack_m, stride) = if first { (OFF[0] * size_m, FIRST_STRIDE) } else { (0.0, 1) };
            let gate = Gate { kernel: KERNEL, slack_m, stride, parameters: state.parameters.len() };
            let sums = sightings(points, &state.poses, &known, gate);
            let before = state.clone();
            let adjusted = self.step(&mut state, &mut known, sums)?;
            round += 1;
            (self.progress)(round);
            let settled = off_m.is_none() && self.is_settled(&before, &state, &adjusted, &known);
            if settled || round >= MOST_ROUNDS {
                let factor = adjusted.factor_on(&known);
                return Ok(Adjusted { state, shared_planes: known, factor, rounds: round, settled, ..adjusted });
            }
        }
    }

    /// Whether every station moved by less than the tolerance, or by so little of its standard deviation that further
    /// rounds tell nothing: along a direction that the surfaces leave open, poses drift with every change of weights.
    fn is_settled(&self, before: &State, after: &State, adjusted: &Adjusted, shared_planes: &[SharedPlane]) -> bool {
        if largest_step(before, after, self.network.hold_m) <= self.tolerance_m {
            return true;
        }
        let (cofactors, factor) = (&adjusted.cofactors, adjusted.factor_on(shared_planes));
        before.poses.iter().zip(&after.poses).enumerate().all(|(k, (a, b))| {
            let step = pose_difference(a, b);
            let own = cofactors.fixed_view::<6, 6>(6 * k, 6 * k) * factor;
            let sigmas = own.cholesky().map_or(f64::INFINITY, |factor| step.dot(&factor.solve(&step)).sqrt());
            k == self.network.fixed || sigmas <= FEW_SIGMAS
        })
    }

    /// What the stations saw of each tile about the planes at the present poses, and how that scatters.
    fn scatter(known: &[SharedPlane], sums: &[Sums], stations: &[usize]) -> (Vec<Vec<TileMean>>, Scatter) {
        let tiles = known.iter().map(|shared_plane| shared_plane.tiles.len()).sum();
        let ones = vec![1.0; tiles * stations.len()];
        let of_shared_plane = |shared_plane: &SharedPlane| {
            let seen = SharedPlaneSums { shared_plane, sums, weights: &ones };
            let eliminated = seen.eliminated(stations, Variances::default());
            eliminated.map_or_else(Vec::new, |eliminated| tile_means(&seen, &eliminated))
        };
        let means: Vec<Vec<TileMean>> = known.par_iter().map(of_shared_plane).collect();
        let scatter = between(&means, stations.len(), tiles, KERNEL);
        (means, scatter)
    }

    /// One linearised step of all unknowns.
    fn step(&self, state: &mut State, known: &mut [SharedPlane], sums: Vec<Sums>) -> Result<Adjusted> {
        let stations: Vec<usize> = (0..state.poses.len()).collect();
        let (means, scatter) = Self::scatter(known, &sums, &stations);
        let variances: Vec<Variances> = means.par_iter().map(|means| variances(means, scatter.shared)).collect();
        let eliminated: Vec<Option<Eliminated>> = (0..known.len())
            .into_par_iter()
            .map(|k| {
                let seen = SharedPlaneSums { shared_plane: &known[k], sums: &sums, weights: &scatter.weights };
                seen.eliminated(&stations, variances[k])
            })
            .collect();
        let parameters = state.parameters.len();
        let mut equations = Equations::new(state.poses.len(), parameters);
        for (shared_plane, eliminated) in known.iter().zip(&eliminated) {
            if let Some(eliminated) = eliminated {
                equations.add(shared_plane, eliminated, &state.poses);
            }
        }
        self.network.turns.iter().for_each(|turn| equations.add_turn(turn, &state.poses));
        let (step, _) = equations.solved(&self.near, state)?;
        let (_, cofactors) = equations.solved(self.network, state)?;
        for (shared_plane, eliminated) in known.iter_mut().zip(&eliminated) {
            if let Some(eliminated) = eliminated {
                let motions = motions(shared_plane, eliminated, &state.poses, &step);
                shared_plane.moved(&eliminated.plane(&motions));
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
            shared_planes: Vec::new(),
            sums,
            scatter,
            means,
            variances,
            cofactors,
            factor: 1.0,
            rounds: 0,
            settled: false,
        })
    }
}

/// Motions of a shared plane's points with a step of all unknowns.
fn motions(
    shared_plane: &SharedPlane,
    eliminated: &Eliminated,
    poses: &[Isometry3<f64>],
    step: &DVector<f64>,
) -> DVector<f64> {
    let mut motions = DVector::zeros(eliminated.right.len());
    for (k, &station) in eliminated.stations.iter().enumerate() {
        let motion = motion_of(shared_plane, &poses[station]).transpose() * step.fixed_rows::<6>(6 * station);
        motions.fixed_rows_mut::<3>(3 * k).copy_from(&motion);
    }
    let (of_motions, of_poses) = (3 * eliminated.stations.len(), 6 * poses.len());
    for k in of_motions..motions.len() {
        motions[k] = step[of_poses + k - of_motions];
    }
    motions
}
