//! How well the poses are known, from the scatter of what the surfaces say.
//!
//! Neither is each contact an observation of its own nor is its standard deviation known: patches serve several pairs,
//! normals are shared with neighbours, and a bump or a range error of the sensor moves all patches of a region. So the
//! scores (derivatives of the sum of squares) are summed over cells of space, over all stations and pairs, and their
//! scatter M between the cells is put between the cofactors: `Q M Q`. Whatever is shared within a cell counts once.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Point3, SymmetricEigen, Vector3, Vector6};

use super::network::{State, relative_jacobians};
use super::reduction::{Meeting, Scene, Weighting};
use super::rounds::Adjusted;
use crate::eigen::eigen6;
use crate::icp::{MotionKind, UndeterminedMotion};
use crate::pose::symmetrised;

/// Size of a cell in patches: wider than the neighbourhoods that normals come from.
const CELL: f64 = 4.0;
/// Cells per unknown below which their scatter is no estimate.
const FEWEST_CELLS_PER_UNKNOWN: usize = 3;

/// Part of the variance at which a motion is held beyond which the contacts say nothing about it.
const NOTHING: f64 = 0.1;

/// Covariance of all unknowns `[stations · 6, parameters]` from their cofactors.
///
/// `hold_m`: standard deviation at which poses are held where no contact says anything (rotations: one radian).
/// `variance_factor`: of the contacts, for networks too small to show a scatter.
pub(super) fn covariance(scene: &Scene<'_>, adjusted: &Adjusted, hold_m: f64, variance_factor: f64) -> DMatrix<f64> {
    let Adjusted { state, cofactors, .. } = adjusted;
    let size = cofactors.nrows();
    let cells = cells(scene, &adjusted.meetings, state, &adjusted.weighting, size);
    let unknowns = size.saturating_sub(6);
    if cells.len() < FEWEST_CELLS_PER_UNKNOWN * unknowns.max(1) {
        return cofactors * variance_factor.max(1.0);
    }
    let mut scatter = DMatrix::zeros(size, size);
    for score in cells.values() {
        scatter.ger(1.0, score, score, 1.0);
    }
    let free = cells.len() as f64 / (cells.len() - unknowns) as f64;
    let held = held(cofactors, 6 * state.poses.len(), hold_m);
    let known = cofactors - &held;
    let covariance = &known * scatter * &known * free + held;
    0.5 * (&covariance + covariance.transpose())
}

/// The part of the cofactors that is nothing but the poses being held: it has no scatter to show.
fn held(cofactors: &DMatrix<f64>, of_poses: usize, hold_m: f64) -> DMatrix<f64> {
    let size = cofactors.nrows();
    let unit = |k: usize| if k < of_poses && k % 6 < 3 { hold_m } else { 1.0 };
    let poses = DMatrix::from_fn(of_poses, of_poses, |r, c| cofactors[(r, c)] / (unit(r) * unit(c)));
    let Some(eigen) = SymmetricEigen::try_new(poses, 1e-15, 100_000) else { return DMatrix::zeros(size, size) };
    let mut held = DMatrix::zeros(size, size);
    for k in (0..of_poses).filter(|&k| eigen.eigenvalues[k] > NOTHING) {
        let vector =
            DVector::from_fn(size, |r, _| if r < of_poses { eigen.eigenvectors[(r, k)] * unit(r) } else { 0.0 });
        held.ger(eigen.eigenvalues[k], &vector, &vector, 1.0);
    }
    held
}

/// The motions of a station that are held because no contact determines them, from the covariance of its pose.
pub(super) fn undetermined(pose: &Isometry3<f64>, covariance: &Matrix6<f64>, hold_m: f64) -> Vec<UndeterminedMotion> {
    // Both parts about world axes, rotations as lengths at the radius at which they are held.
    let turned = pose.rotation.to_rotation_matrix().into_inner() * hold_m;
    let mut to_world = Matrix6::identity();
    to_world.fixed_view_mut::<3, 3>(3, 3).copy_from(&turned);
    let Ok((values, vectors)) = eigen6(&symmetrised(&(to_world * covariance * to_world.transpose())), "a covariance")
    else {
        return Vec::new();
    };
    let open = (0..6).filter(|&k| values[k] > NOTHING * hold_m * hold_m);
    open.map(|k| named(pose, &vectors.column(k).into_owned(), values[k].sqrt(), hold_m)).collect()
}

fn named(pose: &Isometry3<f64>, motion: &Vector6<f64>, sigma_m: f64, hold_m: f64) -> UndeterminedMotion {
    let (slide, turn) = (Vector3::new(motion[0], motion[1], motion[2]), Vector3::new(motion[3], motion[4], motion[5]));
    if turn.norm() < slide.norm() {
        let through = Point3::from(pose.translation.vector);
        return UndeterminedMotion { kind: MotionKind::Translation, axis: slide / slide.norm(), through, sigma_m };
    }
    let w = turn / hold_m;
    let through = Point3::from(pose.translation.vector + w.cross(&slide) / w.norm_squared());
    UndeterminedMotion { kind: MotionKind::Rotation, axis: turn / turn.norm(), through, sigma_m }
}

fn cells(
    scene: &Scene<'_>,
    meetings: &[Meeting],
    state: &State,
    weighting: &Weighting,
    size: usize,
) -> BTreeMap<[i64; 3], DVector<f64>> {
    let mut cells: BTreeMap<[i64; 3], DVector<f64>> = BTreeMap::new();
    for meeting in meetings {
        let (target, source) = (&state.poses[meeting.target], &state.poses[meeting.source]);
        let [by_target, by_source] = relative_jacobians(target, source);
        for (cell, score) in cells_of_pair(scene, meeting, target, source, weighting) {
            let total = cells.entry(cell).or_insert_with(|| DVector::zeros(size));
            let relative = score.fixed_rows::<6>(0);
            let mut of_target = total.fixed_rows_mut::<6>(6 * meeting.target);
            of_target += by_target.transpose() * relative;
            let mut of_source = total.fixed_rows_mut::<6>(6 * meeting.source);
            of_source += by_source.transpose() * relative;
            let mut shared = total.rows_mut(size - scene.parameters, scene.parameters);
            shared += score.rows(6, scene.parameters);
        }
    }
    cells
}

fn cells_of_pair(
    scene: &Scene<'_>,
    meeting: &Meeting,
    world_from_target: &Isometry3<f64>,
    world_from_source: &Isometry3<f64>,
    weighting: &Weighting,
) -> BTreeMap<[i64; 3], DVector<f64>> {
    let source = scene.surfaces[meeting.source];
    let pose = world_from_target.inverse() * world_from_source;
    let mut cells: BTreeMap<[i64; 3], DVector<f64>> = BTreeMap::new();
    for contact in &meeting.contacts {
        let (row, _) = scene.row(meeting, contact, &pose, weighting);
        let place = world_from_source * source.patches[contact.source as usize].centre;
        let cell = place.coords.map(|c| (c / (CELL * source.size_m)).floor());
        let score = cells
            .entry([cell.x as i64, cell.y as i64, cell.z as i64])
            .or_insert_with(|| DVector::zeros(6 + scene.parameters));
        score.axpy(row.weight * row.residual, &row.jacobian, 1.0);
    }
    cells
}
