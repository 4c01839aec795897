//! The normal equations of a large network, of whose blocks few are filled.
//!
//! A plane that a few stations saw is eliminated as in small networks, and couples them with each other. One that very many saw, as
//! the floor of a building, stays beside them: eliminated, it would fill the whole matrix.

use nalgebra::{Const, DVector, Dyn, Isometry3, Matrix3, Matrix6, Matrix6x3, OMatrix, U6};
use rigid_pose::{InputError, pose_difference};
use sparse_matrices::BlockMatrix;

use crate::adjustment::cofactors::Cofactors;
use crate::adjustment::network::Network;
use crate::adjustment::turns::MeasuredTurn;
use crate::error::Result;
use crate::planes::elimination::{Eliminated, Products, WideProducts, motion_of};
use crate::planes::shared_planes::SharedPlane;

/// Stations beyond which the normal matrix is factorised sparsely: below, the dense one takes some milliseconds.
pub(crate) const DENSE_STATIONS: usize = 40;
/// Stations that saw a plane beyond which it stays beside them. Those of one room see its walls from so many stations; with 12 or
/// 48 the work is the same within a tenth.
pub(crate) const MOST_ELIMINATED: usize = 24;

/// Normal equations of all stations, then three unknowns for each plane that stays.
pub(crate) struct SparseEquations {
    normal: BlockMatrix,
    right: DVector<f64>,
    stations: usize,
    /// The next plane that stays.
    next: usize,
}

impl SparseEquations {
    /// `planes`: how many stay beside the stations.
    pub(crate) fn new(stations: usize, fixed: usize, planes: usize) -> Self {
        let mut widths: Vec<usize> = (0..stations).map(|station| if station == fixed { 0 } else { 6 }).collect();
        widths.resize(stations + planes, 3);
        let normal = BlockMatrix::new(&widths);
        let right = DVector::zeros(normal.order());
        Self { normal, right, stations, next: stations }
    }

    pub(crate) fn add(&mut self, shared_plane: &SharedPlane, eliminated: &Eliminated, poses: &[Isometry3<f64>]) {
        let motions: Vec<Matrix6x3<f64>> =
            eliminated.stations.iter().map(|&station| motion_of(shared_plane, &poses[station])).collect();
        for (k, (&station, motion)) in eliminated.stations.iter().zip(&motions).enumerate() {
            if self.normal.width(station) > 0 {
                let mut right = self.right.fixed_rows_mut::<6>(self.normal.start(station));
                right += motion * eliminated.right.fixed_rows::<3>(3 * k);
            }
        }
        match &eliminated.products {
            Products::Eliminated(products) => {
                for a in 0..motions.len() {
                    for b in 0..=a {
                        let own: Matrix3<f64> = products.fixed_view::<3, 3>(3 * a, 3 * b).into_owned();
                        self.add_pair(&eliminated.stations, &motions, (a, b), &own);
                    }
                }
            }
            Products::Beside(wide) => self.add_wide(&eliminated.stations, &motions, wide),
        }
    }

    fn add_pair(
        &mut self,
        stations: &[usize],
        motions: &[Matrix6x3<f64>],
        (a, b): (usize, usize),
        products: &Matrix3<f64>,
    ) {
        let block = motions[a] * products * motions[b].transpose();
        self.normal.add(stations[a], stations[b], |i, j| block[(i, j)]);
    }

    fn add_wide(&mut self, stations: &[usize], motions: &[Matrix6x3<f64>], wide: &WideProducts) {
        for (&pair, products) in &wide.pairs {
            self.add_pair(stations, motions, pair, products);
        }
        let plane = self.next;
        self.next += 1;
        for (k, (&station, motion)) in stations.iter().zip(motions).enumerate() {
            let block = wide.with_plane.fixed_view::<3, 3>(0, 3 * k) * motion.transpose();
            self.normal.add(plane, station, |i, j| block[(i, j)]);
        }
        self.normal.add(plane, plane, |i, j| 0.5 * (wide.of_plane[(i, j)] + wide.of_plane[(j, i)]));
        let mut right = self.right.fixed_rows_mut::<3>(self.normal.start(plane));
        right += wide.right;
    }

    /// Adds rows that two stations take part in, with what is left of them.
    pub(crate) fn add_rows(
        &mut self,
        stations: [usize; 2],
        rows: [&OMatrix<f64, Dyn, U6>; 2],
        residual: &DVector<f64>,
    ) {
        for (n, (own, station)) in rows.iter().zip(stations).enumerate() {
            for (other_rows, other) in rows.iter().zip(stations).take(n + 1) {
                let block: Matrix6<f64> = own.transpose() * *other_rows;
                self.normal.add(station, other, |i, j| block[(i, j)]);
            }
            if self.normal.width(station) > 0 {
                let mut right = self.right.fixed_rows_mut::<6>(self.normal.start(station));
                right += own.transpose() * residual;
            }
        }
    }

    /// Poses are held where they were by the priors that [`Self::cofactors`] adds.
    pub(crate) fn hold(&mut self, network: &Network<'_>, at: &[Isometry3<f64>], now: &[Isometry3<f64>]) {
        for station in (0..self.stations).filter(|station| self.normal.width(*station) > 0) {
            let moved = pose_difference(&at[station], &now[station]);
            let mut right = self.right.fixed_rows_mut::<6>(self.normal.start(station));
            for k in 0..6 {
                right[k] += moved[k] * network.hold_weight(k);
            }
        }
    }

    /// Adds a turn that was measured between two stations.
    pub(crate) fn add_turn(&mut self, turn: &MeasuredTurn, poses: &[Isometry3<f64>]) {
        let Some((residual, by)) = turn.linearised(poses) else { return };
        let [first, second] = by.map(|by| OMatrix::from_fn_generic(Dyn(3), Const::<6>, |row, k| by[(row, k)]));
        let residual = DVector::from_column_slice(residual.as_slice());
        self.add_rows([turn.first, turn.second], [&first, &second], &residual);
    }

    /// Cofactors, with priors that hold what nothing determines.
    pub(crate) fn cofactors(&self, network: &Network<'_>) -> Result<Cofactors> {
        let mut normal = self.normal.clone();
        for station in (0..self.stations).filter(|station| self.normal.width(*station) > 0) {
            for k in 0..6 {
                normal.add_to_diagonal(self.normal.start(station) + k, network.hold_weight(k));
            }
        }
        let failed = |why| InputError::Numerical { what: "the normal equations of all stations", why };
        if normal.diagonal().iter().chain(self.right.iter()).any(|value| !value.is_finite()) {
            return Err(failed("they are not finite").into());
        }
        let factor = normal.factor().ok_or(failed("an unknown is not determined"))?;
        let starts = (0..=self.stations).map(|station| normal.start(station)).collect();
        Ok(Cofactors::sparse(factor, starts, network.fixed))
    }

    /// The step that minimises the squares, six rows a station.
    pub(crate) fn step(&self, cofactors: &Cofactors) -> DVector<f64> {
        let mut step = DVector::zeros(6 * self.stations);
        let solved = cofactors.times(&self.right);
        for station in (0..self.stations).filter(|station| self.normal.width(*station) > 0) {
            let own = solved.fixed_rows::<6>(self.normal.start(station));
            step.fixed_rows_mut::<6>(6 * station).copy_from(&-own);
        }
        step
    }
}

#[cfg(test)]
#[path = "../../tests/inside/sparse_equations.rs"]
mod tests;
