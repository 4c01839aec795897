//! Two stations by themselves, from their patches.

use nalgebra::{Isometry3, Matrix6};

use super::network::{Network, State};
use super::patches::Surface;
use super::precision;
use super::rounds::{Adjusted, Course, Surfaces};
use crate::error::{Error, Result};
use crate::icp::{IcpResult, StopReason};
use crate::kernel::RobustKernel;

/// Rounds of a pair at the last level.
const ROUNDS: usize = 15;

/// Aligns two stations by themselves from a guess that is right to `reach_m`.
pub(super) fn align(
    source: &Surface,
    target: &Surface,
    guess: &Isometry3<f64>,
    reach_m: f64,
    minimum_contacts: usize,
) -> Result<IcpResult> {
    let hold_m = target.radius_m.max(source.radius_m);
    let none = (Vec::new(), Vec::new());
    let course = Course {
        network: Network { fixed: 0, hold_m, names: &[], prior: &none },
        reach_m,
        minimum_contacts,
        kernel: RobustKernel::Tukey,
        max_rounds: ROUNDS,
        tolerance_m: target.size_m / 500.0,
        progress: &|_| {},
    };
    let mut surfaces = Surfaces::fixed(vec![target, source]);
    let start = State { poses: vec![Isometry3::identity(), *guess], parameters: Vec::new() };
    let adjusted = course.run(&mut surfaces, start)?;
    result(&surfaces, &adjusted, hold_m, minimum_contacts)
}

fn result(surfaces: &Surfaces<'_>, adjusted: &Adjusted, hold_m: f64, needed: usize) -> Result<IcpResult> {
    let scene = surfaces.scene(0);
    let max_distance_m = scene.surfaces[0].size_m / 2.0;
    let of = scene.surfaces[1].patches.len();
    let Some(meeting) = adjusted.meetings.first() else {
        let iteration = adjusted.rounds;
        return Err(Error::TooFewCorrespondences { found: 0, of, needed, max_distance_m, iteration });
    };
    let pose = adjusted.state.poses[1];
    let (mut squares, mut weights) = (0.0, 0.0);
    for contact in &meeting.contacts {
        let (row, observed) = scene.row(meeting, contact, &pose, &adjusted.weighting);
        squares += row.weight * observed.residual.powi(2);
        weights += row.weight;
    }
    let factor = adjusted.squares / (adjusted.observations - 6.0).max(1.0);
    let joint = precision::covariance(&scene, adjusted, hold_m, factor);
    let covariance: Matrix6<f64> = joint.fixed_view::<6, 6>(6, 6).into_owned();
    let asked = meeting.contacts.iter().filter(|contact| contact.asked_by_source).count();
    Ok(IcpResult {
        target_from_source: pose,
        covariance,
        overlap: asked as f64 / of as f64,
        rms_m: if weights > 0.0 { (squares / weights).sqrt() } else { 0.0 },
        iterations: adjusted.rounds,
        stop: if adjusted.settled { StopReason::Converged } else { StopReason::WithinNoise },
        correspondences: meeting.contacts.len(),
        max_correspondence_distance_m: max_distance_m,
        degenerate: precision::undetermined(&pose, &covariance, hold_m),
    })
}
