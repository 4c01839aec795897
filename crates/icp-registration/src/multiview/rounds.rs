//! The rounds of the adjustment: contacts found anew, all pairs reduced, all stations moved.

use nalgebra::{DMatrix, Isometry3, Point3};
use rayon::prelude::*;

use super::contacts::{Contact, partners};
use super::network::{Network, State, largest_step};
use super::patches::Surface;
use super::point_model::PointModel;
use super::reduction::{Meeting, Reduced, Scene, Weighting, reduce};
use super::registration::StationRegistrationOptions;
use crate::error::Result;
use crate::kernel::{RobustKernel, mad_scale};

/// Linearised steps on the same contacts.
const STEPS_PER_ROUND: usize = 2;
/// Rounds with a convex kernel, before that of the options.
const WIDE_ROUNDS: usize = 2;

/// What the last round leaves.
pub(super) struct Adjusted {
    pub state: State,
    pub meetings: Vec<Meeting>,
    pub weighting: Weighting,
    pub cofactors: DMatrix<f64>,
    /// Weighted sum of squares and sum of the shares of all contacts.
    pub squares: f64,
    pub observations: f64,
    pub rounds: usize,
    pub settled: bool,
}

/// The surfaces at the present parameters.
pub(super) struct Surfaces<'a> {
    pub surfaces: Vec<Surface>,
    pub derivatives: Vec<Vec<[f64; 3]>>,
    pub model: Option<&'a dyn PointModel>,
    pub points: Vec<usize>,
}

impl Surfaces<'_> {
    pub(super) fn scene(&self, parameters: usize) -> Scene<'_> {
        Scene { surfaces: &self.surfaces, derivatives: &self.derivatives, parameters }
    }

    /// Points, planes and derivatives at these parameters.
    pub(super) fn update(&mut self, parameters: &[f64]) -> Result<()> {
        let Some(model) = self.model else { return Ok(()) };
        let stations: Vec<usize> = (0..self.surfaces.len()).collect();
        let updated: Result<Vec<(Surface, Vec<[f64; 3]>)>> = stations
            .par_iter()
            .map(|&station| {
                let mut row = vec![[0.0; 3]; parameters.len()];
                let count = self.points[station];
                let mut points = vec![Point3::origin(); count];
                let mut of_points = vec![[0.0; 3]; count * parameters.len()];
                for index in self.surfaces[station].members.iter().map(|&index| index as usize) {
                    points[index] = model.point(station, index, parameters, Some(&mut row));
                    of_points[index * parameters.len()..][..parameters.len()].copy_from_slice(&row);
                }
                crate::neighbours::check_points("points of the point model", &points)?;
                let surface = self.surfaces[station].refitted(&points)?;
                let derivatives = averaged(&surface, &of_points, parameters.len());
                Ok((surface, derivatives))
            })
            .collect();
        (self.surfaces, self.derivatives) = updated?.into_iter().unzip();
        Ok(())
    }
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

/// All meetings at these poses; `only`: the pairs to look at (target, source).
pub(super) fn meet(
    surfaces: &[Surface],
    poses: &[Isometry3<f64>],
    only: &[(usize, usize)],
    across_m: f64,
    fewest: usize,
) -> Result<Vec<Meeting>> {
    let found: Result<Vec<Meeting>> = only
        .par_iter()
        .map(|&(target, source)| {
            let pose = poses[target].inverse() * poses[source];
            let (from, to) = (&surfaces[source], &surfaces[target]);
            let forward = partners(from, to, &pose, across_m, 1)?;
            let back = partners(to, from, &pose.inverse(), across_m, 1)?;
            let contact = |source, target, asked_by_source| Contact { source, target, asked_by_source, share: 0.0 };
            let contacts = forward.iter().map(|&(source, target)| contact(source, target, true));
            let contacts = contacts.chain(back.iter().map(|&(target, source)| contact(source, target, false)));
            Ok(Meeting { target, source, contacts: contacts.collect() })
        })
        .collect();
    let mut meetings = found?;
    meetings.retain(|meeting| meeting.contacts.len() >= 2 * fewest);
    share(surfaces, &mut meetings);
    Ok(meetings)
}

/// A patch that k − 1 other stations see as well observes k − 1 differences, each of which would count fully only if
/// its own error entered once: with weights 1/k the squares are those about the common surface.
fn share(surfaces: &[Surface], meetings: &mut [Meeting]) {
    let mut seen: Vec<Vec<u32>> = surfaces.iter().map(|surface| vec![1; surface.patches.len()]).collect();
    for meeting in meetings.iter() {
        for contact in &meeting.contacts {
            let (station, patch) = asking(meeting, contact);
            seen[station][patch] += 1;
        }
    }
    for meeting in meetings.iter_mut() {
        let ends = (meeting.target, meeting.source);
        for contact in &mut meeting.contacts {
            let (station, patch) = match contact.asked_by_source {
                true => (ends.1, contact.source as usize),
                false => (ends.0, contact.target as usize),
            };
            contact.share = 1.0 / f64::from(seen[station][patch]);
        }
    }
}

fn asking(meeting: &Meeting, contact: &Contact) -> (usize, usize) {
    if contact.asked_by_source {
        (meeting.source, contact.source as usize)
    } else {
        (meeting.target, contact.target as usize)
    }
}

/// Standard deviation of the whitened residuals of all contacts, from their median.
fn scale(scene: &Scene<'_>, meetings: &[Meeting], poses: &[Isometry3<f64>]) -> f64 {
    let of_pair = |meeting: &Meeting| -> Vec<f64> {
        let pose = poses[meeting.target].inverse() * poses[meeting.source];
        meeting.contacts.iter().map(|contact| scene.whitened_residual(meeting, contact, &pose).abs()).collect()
    };
    let mut residuals: Vec<f64> = meetings.par_iter().map(of_pair).collect::<Vec<_>>().concat();
    // Exact surfaces leave rounding, which needs no weighting.
    mad_scale(&mut residuals).max(1e-3)
}

/// Adjusts all stations; `start` must be right to about the size of a patch.
pub(super) fn adjust(
    surfaces: &mut Surfaces<'_>,
    start: State,
    network: &Network<'_>,
    options: &StationRegistrationOptions<'_>,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Adjusted> {
    let count = start.poses.len();
    let parameters = start.parameters.len();
    let mut pairs: Vec<(usize, usize)> = (0..count).flat_map(|t| (t + 1..count).map(move |s| (t, s))).collect();
    let size_m = surfaces.surfaces.iter().map(|surface| surface.size_m).fold(0.0, f64::max);
    let tolerance_m = options.tolerance_m.unwrap_or(size_m / 2000.0);
    let mut state = start;
    let mut round = 0;
    loop {
        surfaces.update(&state.parameters)?;
        let wide = round < WIDE_ROUNDS;
        let across_m = if wide { size_m } else { size_m / 2.0 };
        let meetings = meet(&surfaces.surfaces, &state.poses, &pairs, across_m, options.minimum_contacts)?;
        if round == 0 {
            // Stations that do not meet now will not after some millimetres.
            let near = meet(&surfaces.surfaces, &state.poses, &pairs, 2.0 * size_m, options.minimum_contacts / 2)?;
            pairs = near.iter().map(|meeting| (meeting.target, meeting.source)).collect();
        }
        let kernel = if wide && options.kernel != RobustKernel::None { RobustKernel::Huber } else { options.kernel };
        let before = state.clone();
        let mut last = None;
        for _ in 0..STEPS_PER_ROUND {
            let scene = surfaces.scene(parameters);
            let weighting = Weighting { kernel, scale: scale(&scene, &meetings, &state.poses) };
            let reduced = reduced(&scene, &meetings, &state.poses, &weighting)?;
            let squares: f64 = reduced.iter().map(|(_, reduced)| reduced.squares).sum();
            let (next, cofactors) = network.solve(&state, &reduced)?;
            state = next;
            last = Some((weighting, squares, cofactors));
            if parameters > 0 {
                // The residuals follow the parameters only when the points do.
                break;
            }
        }
        round += 1;
        progress(round);
        let settled = !wide && largest_step(&before, &state, network.hold_m) <= tolerance_m;
        if let Some((weighting, squares, cofactors)) = last
            && (settled || round >= options.max_rounds)
        {
            surfaces.update(&state.parameters)?;
            let observations = meetings.iter().flat_map(|m| &m.contacts).map(|contact| contact.share).sum();
            return Ok(Adjusted { state, meetings, weighting, cofactors, squares, observations, rounds: round, settled });
        }
    }
}

fn reduced<'m>(
    scene: &Scene<'_>,
    meetings: &'m [Meeting],
    poses: &[Isometry3<f64>],
    weighting: &Weighting,
) -> Result<Vec<(&'m Meeting, Reduced)>> {
    let reduce = |meeting: &'m Meeting| {
        let pose = poses[meeting.target].inverse() * poses[meeting.source];
        Ok((meeting, reduce(scene, meeting, &pose, weighting)?))
    };
    meetings.par_iter().map(reduce).collect()
}
