//! The last rounds: all points of all stations on shared planes whose planes are unknown too.

use std::collections::BTreeMap;

use nalgebra::{DVector, Isometry3};
use rayon::prelude::*;

use crate::adjustment::cofactors::Cofactors;
use crate::adjustment::equations::{Equations, MOST_ELIMINATED};
use crate::adjustment::known::Known;
use crate::adjustment::network::{Network, State, largest_step};
use crate::adjustment::relaxation::Relaxation;
use crate::adjustment::rounds::{Surfaces, meet, near_each_other};
use crate::error::Result;
use crate::planes::contacts::Reach;
use crate::planes::elimination::{Eliminated, Products, SharedPlaneSums, Variances, motion_of};
use crate::planes::scatter::{Scatter, TileMean, between, tile_means, variances};
use crate::planes::shared_planes::{SharedPlane, shared_planes};
use crate::planes::sightings::{Gate, sightings};
use crate::planes::sums::Sums;
use crate::relative_pose::RelativePose;
use crate::surfaces::plane_fit::SAME_DIRECTION;
use crate::surfaces::points::StationPoints;
use rigid_pose::pose_difference;

/// What the poses may be off in the first rounds, patches: shared planes are joined anew from better poses.
const OFF: [f64; 2] = [0.06, 0.01];

/// Of so many points one is taken in the first round, which need not be better than the contacts of patches.
const FIRST_STRIDE: usize = 3;

/// Most rounds, each with points given to the surfaces anew; most surveys are settled after four to eight. Ranges that are 5 mm off in twice the
/// usual noise take more than twelve. Many stations have half as many each time that places are sought: what slides on between them does not
/// come to rest sooner with more.
pub(crate) const fn most_rounds(whole: bool) -> usize {
    if whole { 24 } else { 12 }
}
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
    pub cofactors: Cofactors,
    /// Factor of the cofactors that makes covariances of them: what tiles scatter beyond the noise of their points is not independent
    /// from tile to tile, and so more than the weights that it takes from them; errors that whole shared planes share are more still.
    pub factor: f64,
    pub rounds: usize,
    pub settled: bool,
    /// Part of the last step that was taken.
    pub share: f64,
    /// What stations have in common; empty until the last round.
    pub common: Common,
    /// Pairs of stations that were held against each other.
    pub pairs_tried: usize,
}

/// The tiles that pairs of stations saw, and the planes of each station.
#[derive(Debug, Clone, Default)]
pub(crate) struct Common {
    /// Of each pair (the smaller station first) the shared plane, and both means among those of it.
    pub pairs: BTreeMap<(u32, u32), Vec<[u32; 3]>>,
    /// The shared planes of each station that another one saw too, ascending.
    pub planes: Vec<Vec<u32>>,
    /// Number of tiles of each station.
    pub tiles: Vec<usize>,
}

impl Common {
    fn new(stations: usize, means: &[Vec<TileMean>]) -> Self {
        let mut this = Self { pairs: BTreeMap::new(), planes: vec![Vec::new(); stations], tiles: vec![0; stations] };
        for (plane, means) in means.iter().enumerate() {
            let plane = plane as u32;
            for mean in means {
                this.tiles[mean.station] += 1;
                if this.planes[mean.station].last() != Some(&plane) {
                    this.planes[mean.station].push(plane);
                }
            }
            let mut first = 0;
            for tile in means.chunk_by(|a, b| a.tile == b.tile) {
                for (a, one) in tile.iter().enumerate() {
                    for (b, other) in tile.iter().enumerate().skip(a + 1) {
                        let pair = (one.station as u32, other.station as u32);
                        this.pairs.entry(pair).or_default().push([plane, (first + a) as u32, (first + b) as u32]);
                    }
                }
                first += tile.len();
            }
        }
        this
    }
}

impl Adjusted {
    /// Differences between stations within tiles less unknowns.
    pub(crate) fn redundancy(&self) -> i64 {
        let unknowns = self.cofactors.unknowns() as i64 - 6;
        self.scatter.differences.round() as i64 - unknowns
    }

    /// Standard deviation of unit weight of what stations saw of the same tiles; `None` without redundancy.
    pub(crate) fn sigma0(&self) -> Option<f64> {
        let redundancy = self.redundancy();
        (redundancy > 0).then(|| (self.scatter.squares / redundancy as f64).sqrt())
    }

    /// Factor of the variances that single tiles ask for.
    pub(crate) fn factor_of_tiles(&self) -> f64 {
        self.sigma0().map_or(1.0, |sigma0| sigma0.powi(2).max(1.0))
    }
}

/// How the rounds go.
pub(crate) struct Finish<'a> {
    pub network: &'a Network<'a>,
    /// The same with poses held at what the rounds start from: along a direction that the surfaces leave open, shared planes
    /// farther off would be others.
    pub near: Known,
    /// Movement at which the rounds end, metre.
    pub tolerance_m: f64,
    pub progress: &'a (dyn Fn(usize) + Sync),
    /// What is known of many stations beside what surfaces tell.
    pub joints: Vec<RelativePose>,
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
        let (mut known, mut round, mut pairs_tried) = (Vec::new(), 0, 0);
        let mut relaxation = Relaxation::default();
        loop {
            surfaces.update(&state.parameters)?;
            surfaces.place(points, &state.parameters)?;
            let scene = surfaces.scene(0);
            let off_m = OFF.get(round).map(|off| off * size_m);
            if let Some(off_m) = off_m {
                let reach = Reach { across_m: size_m / 4.0, cosine: SAME_DIRECTION };
                let near = near_each_other(&scene.surfaces, &state.poses, reach)?;
                pairs_tried = near.len();
                let pairs_in_contact = meet(&scene.surfaces, &state.poses, &near, reach);
                known = shared_planes(&scene.surfaces, &state.poses, &pairs_in_contact, off_m)?;
            }
            let first = round == 0;
            let (slack_m, stride) = if first { (OFF[0] * size_m, FIRST_STRIDE) } else { (0.0, 1) };
            let gate = Gate { slack_m, stride, parameters: state.parameters.len() };
            let sums = sightings(points, &state.poses, &known, gate);
            // Rounds from other shared planes do not undo each other. Of many stations one would shorten the steps of all.
            let relaxation = (off_m.is_none() && self.network.whole).then_some(&mut relaxation);
            let adjusted = self.step(&state, known, sums, relaxation)?;
            round += 1;
            (self.progress)(round);
            let settled = off_m.is_none() && self.settles(&state, &adjusted);
            if settled || round >= most_rounds(self.network.whole) {
                let common = Common::new(state.poses.len(), &adjusted.means);
                let factor = adjusted.factor_of_tiles();
                return Ok(Adjusted { factor, rounds: round, settled, common, pairs_tried, ..adjusted });
            }
            (state, known) = (adjusted.state, adjusted.shared_planes);
        }
    }

    /// Whether no station moved by more than the tolerance, or by so much of its standard deviation that further rounds tell
    /// something: along a direction that the surfaces leave open, poses drift with every change of weights. Steps count whole.
    fn settles(&self, before: &State, adjusted: &Adjusted) -> bool {
        let Adjusted { state: after, cofactors, share, .. } = adjusted;
        if largest_step(before, after, self.network.hold_m) <= share * self.tolerance_m {
            return true;
        }
        // Of many stations the wider factor takes as long as a round; without it what is asked here is stricter.
        let factor = if self.network.whole { adjusted.factor_of_wide_errors() } else { adjusted.factor_of_tiles() };
        let is_settled = |k: usize| {
            let step = pose_difference(&before.poses[k], &after.poses[k]);
            let own = cofactors.of(k) * factor;
            let sigmas = own.cholesky().map_or(f64::INFINITY, |factor| step.dot(&factor.solve(&step)).sqrt());
            // Not a number is no small one.
            k == self.network.fixed || sigmas <= share * FEW_SIGMAS
        };
        (0..after.poses.len()).all(is_settled)
    }

    /// What the stations saw of each tile about the planes at the present poses, and how that scatters.
    fn scatter(known: &[SharedPlane], sums: &[Sums], observers: &[Vec<usize>]) -> (Vec<Vec<TileMean>>, Scatter) {
        let of_shared_plane = |(shared_plane, stations): (&SharedPlane, &Vec<usize>)| {
            let seen = SharedPlaneSums { shared_plane, sums, weights: None };
            let eliminated = seen.eliminated(stations, Variances::default(), MOST_ELIMINATED);
            eliminated.map_or_else(Vec::new, |eliminated| tile_means(&seen, &eliminated))
        };
        let means: Vec<Vec<TileMean>> = known.par_iter().zip(observers).map(of_shared_plane).collect();
        let scatter = between(&means, sums);
        (means, scatter)
    }

    /// One linearised step of all unknowns, or the part of it that does not lead there and back.
    fn step(
        &self,
        state: &State,
        mut known: Vec<SharedPlane>,
        sums: Vec<Sums>,
        relaxation: Option<&mut Relaxation>,
    ) -> Result<Adjusted> {
        let observers = observers(&known, &sums);
        let (means, scatter) = Self::scatter(&known, &sums, &observers);
        let variances: Vec<Variances> = means.par_iter().map(|means| variances(means, scatter.shared)).collect();
        let eliminated: Vec<Option<Eliminated>> = (0..known.len())
            .into_par_iter()
            .map(|k| {
                let seen = SharedPlaneSums { shared_plane: &known[k], sums: &sums, weights: Some(&scatter.weights) };
                seen.eliminated(&observers[k], variances[k], MOST_ELIMINATED)
            })
            .collect();
        let seen = known.iter().zip(&eliminated).filter_map(|(plane, eliminated)| Some((plane, eliminated.as_ref()?)));
        let (step, cofactors) = self.solved(state, seen)?;
        // Metres and radians in one: as rotations move what is a metre away.
        let of_poses = step.rows(0, 6 * state.poses.len()).into_owned();
        let share = relaxation.map_or(1.0, |relaxation| relaxation.share(of_poses));
        let step = share * step;
        for (shared_plane, eliminated) in known.iter_mut().zip(&eliminated) {
            if let Some(eliminated) = eliminated {
                let motions = motions(shared_plane, eliminated, &state.poses, &step);
                shared_plane.moved(&eliminated.plane(&motions));
            }
        }
        let mut state = state.clone();
        state.moved(&step);
        Ok(Adjusted {
            state,
            shared_planes: known,
            sums,
            scatter,
            means,
            variances,
            cofactors,
            factor: 1.0,
            rounds: 0,
            settled: false,
            share,
            common: Common::default(),
            pairs_tried: 0,
        })
    }

    /// The step of all unknowns, poses being held near where they are, and cofactors.
    fn solved<'s>(
        &self,
        state: &State,
        seen: impl Iterator<Item = (&'s SharedPlane, &'s Eliminated)> + Clone,
    ) -> Result<(DVector<f64>, Cofactors)> {
        let network = self.network;
        let planes = seen.clone().filter(|(_, eliminated)| matches!(eliminated.products, Products::Beside(..))).count();
        let mut equations = Equations::new(state.poses.len(), Some(network.fixed), state.parameters.len(), planes);
        seen.for_each(|(shared_plane, eliminated)| equations.add(shared_plane, eliminated, &state.poses));
        equations.add_prior(&network.prior, &state.parameters);
        for turn in network.turns {
            equations.add_turn(turn, &state.poses);
        }
        for joint in &self.joints {
            equations.add_relative_pose(joint, None, &DVector::zeros(1), &state.poses);
        }
        let step = equations.step(&equations.cofactors(self.near)?);
        Ok((step, equations.cofactors(network.held())?))
    }
}

/// The stations that saw something of each shared plane, ascending.
fn observers(known: &[SharedPlane], sums: &[Sums]) -> Vec<Vec<usize>> {
    let mut observers: Vec<Vec<usize>> = vec![Vec::new(); known.len()];
    for (station, sums) in sums.iter().enumerate() {
        let mut slot = 0;
        while slot < sums.tiles() {
            let plane = known.partition_point(|plane| plane.tiles.first <= sums.tile(slot)) - 1;
            observers[plane].push(station);
            slot = sums.slots(&(0..known[plane].tiles.first + known[plane].tiles.len())).end;
        }
    }
    observers
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
    let shared = step.rows_range(6 * poses.len()..);
    motions.rows_mut(3 * eliminated.stations.len(), shared.len()).copy_from(&shared);
    motions
}
