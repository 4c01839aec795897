//! The normal equations of all stations and shared parameters.

use nalgebra::{DMatrix, DVector, Isometry3};
use rigid_pose::InputError;

use crate::adjustment::cofactors::Cofactors;
use crate::adjustment::network::{Network, State};
use crate::adjustment::turns::MeasuredTurn;
use crate::error::Result;
use crate::planes::elimination::{Eliminated, Products, motion_of};
use crate::planes::shared_planes::SharedPlane;

/// Normal equations of all stations and parameters as whole matrices.
pub(crate) struct Equations {
    pub normal: DMatrix<f64>,
    pub right: DVector<f64>,
    stations: usize,
}

impl Equations {
    pub(crate) fn new(stations: usize, parameters: usize) -> Self {
        let size = 6 * stations + parameters;
        Self { normal: DMatrix::zeros(size, size), right: DVector::zeros(size), stations }
    }

    pub fn add(&mut self, shared_plane: &SharedPlane, eliminated: &Eliminated, poses: &[Isometry3<f64>]) {
        let count = eliminated.stations.len();
        let parameters = self.right.len() - 6 * self.stations;
        // Columns: the unknowns of the shared plane, then all.
        let mut to_all = DMatrix::zeros(eliminated.right.len(), 6 * count + parameters);
        for (k, &station) in eliminated.stations.iter().enumerate() {
            let motion = motion_of(shared_plane, &poses[station]).transpose();
            to_all.fixed_view_mut::<3, 6>(3 * k, 6 * k).copy_from(&motion);
        }
        for k in 0..parameters {
            to_all[(3 * count + k, 6 * count + k)] = 1.0;
        }
        let Products::Eliminated(normal) = &eliminated.products else { return };
        let normal = to_all.transpose() * normal * &to_all;
        let right = to_all.transpose() * &eliminated.right;
        let place = |k: usize| match eliminated.stations.get(k / 6) {
            Some(station) => 6 * station + k % 6,
            None => 6 * self.stations + k - 6 * count,
        };
        for row in 0..right.len() {
            for column in 0..right.len() {
                self.normal[(place(row), place(column))] += normal[(row, column)];
            }
            self.right[place(row)] += right[row];
        }
    }

    /// Adds a turn that was measured between two stations.
    pub(crate) fn add_turn(&mut self, turn: &MeasuredTurn, poses: &[Isometry3<f64>]) {
        let Some((residual, by)) = turn.linearised(poses) else { return };
        let places = [6 * turn.first, 6 * turn.second];
        for (by_row, row) in by.iter().zip(places) {
            for (by_column, column) in by.iter().zip(places) {
                let mut block = self.normal.fixed_view_mut::<6, 6>(row, column);
                block += by_row.transpose() * by_column;
            }
            let mut right = self.right.fixed_rows_mut::<6>(row);
            right += by_row.transpose() * residual;
        }
    }

    /// The step that minimises the squares, with priors that hold what nothing determines, and the cofactors.
    pub(crate) fn solved(&self, network: &Network<'_>, state: &State) -> Result<(DVector<f64>, Cofactors)> {
        let of_poses = 6 * self.stations;
        let (mut normal, mut right) = (self.normal.clone(), self.right.clone());
        for k in 0..of_poses {
            normal[(k, k)] += if k % 6 < 3 { network.hold_m.powi(-2) } else { network.turn_rad.powi(-2) };
        }
        for (k, (sigma, value)) in network.prior.1.iter().zip(&network.prior.0).enumerate() {
            let weight = if sigma.is_finite() { sigma.powi(-2) } else { 0.0 };
            normal[(of_poses + k, of_poses + k)] += weight;
            right[of_poses + k] += weight * (state.parameters[k] - value);
        }
        let (size, held) = (right.len(), 6 * network.fixed);
        let free: Vec<usize> = (0..size).filter(|k| !(held..held + 6).contains(k)).collect();
        let scale: Vec<f64> = free.iter().map(|&k| normal[(k, k)].sqrt().recip()).collect();
        let n = free.len();
        let scaled = DMatrix::from_fn(n, n, |r, c| {
            0.5 * (normal[(free[r], free[c])] + normal[(free[c], free[r])]) * scale[r] * scale[c]
        });
        let failed = |why| InputError::Numerical { what: "the normal equations of all stations", why };
        if scaled.iter().chain(right.iter()).any(|value| !value.is_finite()) {
            return Err(failed("they are not finite").into());
        }
        let inverse = scaled.cholesky().ok_or(failed("an unknown is not determined"))?.inverse();
        let mut cofactors = DMatrix::zeros(size, size);
        for (r, &row) in free.iter().enumerate() {
            for (c, &column) in free.iter().enumerate() {
                cofactors[(row, column)] = inverse[(r, c)] * scale[r] * scale[c];
            }
        }
        Ok((-(&cofactors * &right), Cofactors::Whole { matrix: cofactors, stations: self.stations }))
    }
}
