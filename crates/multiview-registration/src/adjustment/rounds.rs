//! The wide rounds: contacts of patches found anew, all pairs reduced, all stations moved.

use nalgebra::Isometry3;
use rayon::prelude::*;
use rigid_pose::InputError;
use statistics::mad_scale;

use crate::adjustment::known::Known;
use crate::adjustment::network::{Anchors, Network, State, largest_step};
use crate::error::Result;
use crate::planes::contacts::{Contact, Reach, TURNED, partners};
use crate::planes::reduction::{PairContacts, Reduced, Scene, reduce};
use crate::surfaces::extents::Extent;
use crate::surfaces::patches::Surface;
use crate::surfaces::plane_fit::SAME_DIRECTION;
use crate::surfaces::point_model::{PointModel, evaluated};
use crate::surfaces::points::StationPoints;

/// Most rounds of a level, and the part of its limit that a step must be below for it to end.
const ROUNDS: usize = 8;
const SMALL_STEP: f64 = 100.0;
/// Fewest patches, or tiles, in which two stations must meet to be held together: a few meet by chance anywhere.
pub(crate) const FEWEST_CONTACTS: usize = 15;

/// Derivatives of the patches of each station by all parameters, patch by patch.
pub(crate) type PatchDerivatives = Vec<Vec<[f64; 3]>>;

/// The surfaces at the present parameters.
pub(crate) struct Surfaces<'a> {
    /// As they were given.
    pub given: Vec<&'a Surface>,
    /// At the present parameters, with the derivatives of their patches; `None` without parameters.
    pub modelled: Option<(Vec<Surface>, PatchDerivatives)>,
    /// The model, with the number of points of each station.
    pub model: Option<(&'a dyn PointModel, Vec<usize>)>,
}

impl<'a> Surfaces<'a> {
    pub(crate) fn fixed(given: Vec<&'a Surface>) -> Self {
        Self { given, modelled: None, model: None }
    }

    pub(crate) fn scene(&self, parameters: usize) -> Scene<'_> {
        match &self.modelled {
            Some((surfaces, derivatives)) => Scene { surfaces: surfaces.iter().collect(), derivatives, parameters },
            None => Scene { surfaces: self.given.clone(), derivatives: &[], parameters },
        }
    }

    /// Points, planes and derivatives at these parameters.
    pub(crate) fn update(&mut self, parameters: &[f64]) -> Result<()> {
        let Some((model, points)) = &self.model else { return Ok(()) };
        let modelled: Result<Vec<(Surface, Vec<[f64; 3]>)>> = (0..self.given.len())
            .into_par_iter()
            .map(|station| at_parameters(self.given[station], *model, station, points[station], parameters))
            .collect();
        self.modelled = Some(modelled?.into_iter().unzip());
        Ok(())
    }

    /// Puts the points of all stations where they are at these parameters.
    pub(crate) fn place(&self, points: &mut [StationPoints], parameters: &[f64]) -> Result<()> {
        let Some((model, counts)) = &self.model else { return Ok(()) };
        points
            .par_iter_mut()
            .enumerate()
            .try_for_each(|(station, points)| points.follow(*model, station, counts[station], parameters))
    }
}

fn at_parameters(
    surface: &Surface,
    model: &dyn PointModel,
    station: usize,
    count: usize,
    parameters: &[f64],
) -> Result<(Surface, Vec<[f64; 3]>)> {
    let (points, of_points) = evaluated(model, station, count, parameters)?;
    let surface = surface.refitted(&points)?;
    let derivatives = averaged(&surface, &of_points, parameters.len());
    Ok((surface, derivatives))
}

/// Derivatives of the patches' centres from those of their points.
fn averaged(surface: &Surface, of_points: &[[f64; 3]], parameters: usize) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; surface.patches.len() * parameters];
    for patch in 0..surface.patches.len() {
        let members = surface.points_of(patch);
        for &index in members {
            for k in 0..parameters {
                for axis in 0..3 {
                    out[patch * parameters + k][axis] +=
                        of_points[index as usize * parameters + k][axis] / members.len() as f64;
                }
            }
        }
    }
    out
}

/// The pairs of stations (target, source) that may have partners at these poses, ascending: all others lie too far apart.
pub(crate) fn near_each_other(
    surfaces: &[&Surface],
    poses: &[Isometry3<f64>],
    reach: Reach,
) -> Result<Vec<(usize, usize)>> {
    let size_m = surfaces.iter().map(|surface| surface.size_m).fold(0.0, f64::max);
    let extent = |(surface, pose): (&&Surface, &Isometry3<f64>)| {
        let centres = surface.patches.iter().map(|patch| &patch.centre);
        if let Some(index) = centres.clone().position(|centre| !rigid_pose::is_usable(&(pose * centre))) {
            return Err(InputError::NonFinite { what: "points of a station in the frame of another", index }.into());
        }
        Ok(Extent::placed(centres, pose))
    };
    let extents = surfaces.iter().zip(poses).map(extent).collect::<Result<Vec<Extent>>>()?;
    Ok(Extent::pairs(&extents, reach.farthest_m(size_m)))
}

/// All pairs in contact at these poses; `only`: the pairs to look at (target, source).
pub(crate) fn meet(
    surfaces: &[&Surface],
    poses: &[Isometry3<f64>],
    only: &[(usize, usize)],
    reach: Reach,
) -> Vec<PairContacts> {
    let contacts = |&(target, source): &(usize, usize)| {
        let pose = poses[target].inverse() * poses[source];
        let (from, to) = (surfaces[source], surfaces[target]);
        let forward = partners(from, to, &pose, reach).into_iter();
        let back = partners(to, from, &pose.inverse(), reach).into_iter().map(|(target, source)| (source, target));
        let contacts = forward.chain(back).map(|(source, target)| Contact { source, target });
        PairContacts { target, source, contacts: contacts.collect() }
    };
    let mut pairs_in_contact: Vec<PairContacts> = only.par_iter().map(contacts).collect();
    pairs_in_contact.retain(|pair_contacts| pair_contacts.contacts.len() >= 2 * FEWEST_CONTACTS);
    pairs_in_contact
}

/// Standard deviation of the whitened residuals of all contacts, from their median.
fn scale(scene: &Scene<'_>, pairs_in_contact: &[PairContacts], poses: &[Isometry3<f64>]) -> f64 {
    let of_pair = |pair_contacts: &PairContacts| -> Vec<f64> {
        let pose = poses[pair_contacts.target].inverse() * poses[pair_contacts.source];
        pair_contacts
            .contacts
            .iter()
            .map(|&contact| scene.whitened_residual(pair_contacts, contact, &pose).abs())
            .collect()
    };
    let mut residuals: Vec<f64> = pairs_in_contact.par_iter().map(of_pair).collect::<Vec<_>>().concat();
    // Exact surfaces leave rounding, which needs no weighting.
    mad_scale(&mut residuals).max(1e-3)
}

/// How the rounds go.
#[derive(Clone, Copy)]
pub(crate) struct WideRounds<'a> {
    pub network: &'a Network<'a>,
    /// Largest error of the start poses, metre.
    pub reach_m: f64,
    pub progress: &'a (dyn Fn(usize) + Sync),
}

impl WideRounds<'_> {
    /// Falling limits: far partners first, so that a station that has slid along a wall is drawn back by what stands on it.
    fn levels(&self, size_m: f64) -> Vec<Reach> {
        let mut levels = Vec::new();
        let mut across_m = self.reach_m;
        while across_m > 1.2 * size_m {
            levels.push(Reach { across_m, cosine: TURNED });
            across_m /= 2.0;
        }
        levels.push(Reach { across_m: size_m, cosine: SAME_DIRECTION });
        levels.push(Reach { across_m: size_m / 2.0, cosine: SAME_DIRECTION });
        levels
    }

    /// One step of all stations. Many are held at their start as well as that is known, which
    /// how far all have moved tells: where little else stands along a wall a station
    /// would slide farther than it can be off, and meet the wrong things there. None keeps its pose: the others would bend about it.
    fn solved(
        &self,
        state: &State,
        (start, known): (&[Isometry3<f64>], Known),
        reduced: &[(&PairContacts, Reduced)],
        scale: f64,
    ) -> Result<State> {
        let (network, poses) = (self.network, &state.poses[..]);
        let few = Anchors { fixed: Some(network.fixed), poses, known: network.held(), factor: 1.0 };
        let many = Anchors { fixed: None, poses: start, known, factor: scale * scale };
        network.solve(state, reduced, if network.whole { &few } else { &many })
    }

    /// Brings all stations from start poses that are right to about the reach to a part of a patch.
    pub(crate) fn run(&self, surfaces: &mut Surfaces<'_>, start: &State) -> Result<State> {
        let size_m = surfaces.given.iter().map(|surface| surface.size_m).fold(0.0, f64::max);
        let mut state = start.clone();
        let mut rounds = 0;
        let radius_m = self.network.hold_m;
        let mut known = Known::at(self.reach_m, radius_m);
        for reach in self.levels(size_m) {
            let mut pairs = Vec::new();
            for in_level in 0..ROUNDS {
                surfaces.update(&state.parameters)?;
                let scene = surfaces.scene(state.parameters.len());
                if in_level == 0 {
                    pairs = near_each_other(&scene.surfaces, &state.poses, reach)?;
                }
                let pairs_in_contact = meet(&scene.surfaces, &state.poses, &pairs, reach);
                if in_level == 0 {
                    // Stations that do not meet now will not after the small steps of one level.
                    pairs = pairs_in_contact
                        .iter()
                        .map(|pair_contacts| (pair_contacts.target, pair_contacts.source))
                        .collect();
                }
                let scale = scale(&scene, &pairs_in_contact, &state.poses);
                let reduced = reduced(&scene, &pairs_in_contact, &state.poses, scale)?;
                let next = self.solved(&state, (&start.poses, known), &reduced, scale)?;
                let moved_m = largest_step(&state, &next, radius_m);
                state = next;
                known = Known::estimated(&start.poses, &state.poses, (size_m, self.reach_m), radius_m);
                rounds += 1;
                (self.progress)(rounds);
                if moved_m <= reach.across_m / SMALL_STEP {
                    break;
                }
            }
        }
        Ok(state)
    }
}

fn reduced<'m>(
    scene: &Scene<'_>,
    pairs_in_contact: &'m [PairContacts],
    poses: &[Isometry3<f64>],
    scale: f64,
) -> Result<Vec<(&'m PairContacts, Reduced)>> {
    let reduce = |pair_contacts: &'m PairContacts| {
        let pose = poses[pair_contacts.target].inverse() * poses[pair_contacts.source];
        Ok((pair_contacts, reduce(scene, pair_contacts, &pose, scale)?))
    };
    pairs_in_contact.par_iter().map(reduce).collect()
}
