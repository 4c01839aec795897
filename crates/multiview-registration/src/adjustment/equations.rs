//! The normal equations of all stations and of what they share, of whose blocks few are filled in a large network.
//!
//! A plane that a few stations saw is eliminated, and couples them with each other. One that very many saw, as the floor of a
//! building, stays beside them: eliminated, it would fill the whole matrix.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix6, Matrix6x3};
use rigid_pose::{InputError, pose_difference};
use sparse_matrices::BlockMatrix;

use crate::adjustment::cofactors::Cofactors;
use crate::adjustment::known::Known;
use crate::adjustment::turns::MeasuredTurn;
use crate::error::Result;
use crate::planes::elimination::{Eliminated, Products, motion_of};
use crate::planes::shared_planes::SharedPlane;
use crate::relative_pose::{RelativePose, relative_pose_parts};
use crate::surfaces::point_model::Prior;

/// Stations that saw a plane beyond which it stays beside them. Those of one room see its walls from so many stations; with 12 or
/// 48 the work is the same within a tenth.
pub(crate) const MOST_ELIMINATED: usize = 24;

/// Normal equations: six unknowns a station, the shared parameters, then three for each plane that stays.
pub(crate) struct Equations {
    normal: BlockMatrix,
    right: DVector<f64>,
    /// Their number, and the block of the shared parameters.
    stations: usize,
    /// The next plane that stays.
    next: usize,
}

impl Equations {
    /// `fixed`: the station that keeps its pose, if any; `planes`: how many stay beside the stations.
    pub(crate) fn new(stations: usize, fixed: Option<usize>, parameters: usize, planes: usize) -> Self {
        let mut widths: Vec<usize> = (0..stations).map(|station| if Some(station) == fixed { 0 } else { 6 }).collect();
        widths.push(parameters);
        widths.resize(stations + 1 + planes, 3);
        let normal = BlockMatrix::new(&widths);
        let right = DVector::zeros(normal.order());
        Self { normal, right, stations, next: stations + 1 }
    }

    pub(crate) fn add(&mut self, shared_plane: &SharedPlane, eliminated: &Eliminated, poses: &[Isometry3<f64>]) {
        let motions: Vec<Matrix6x3<f64>> =
            eliminated.stations.iter().map(|&station| motion_of(shared_plane, &poses[station])).collect();
        for (k, (&station, motion)) in eliminated.stations.iter().zip(&motions).enumerate() {
            self.add_right(station, (motion * eliminated.right.fixed_rows::<3>(3 * k)).as_slice());
        }
        match &eliminated.products {
            Products::Eliminated(products) => {
                for a in 0..motions.len() {
                    for b in 0..=a {
                        let own: Matrix3<f64> = products.fixed_view::<3, 3>(3 * a, 3 * b).into_owned();
                        self.add_pair(&eliminated.stations, &motions, (a, b), &own);
                    }
                }
                self.add_shared(eliminated, products, &motions);
            }
            Products::Beside(pairs, of_plane) => {
                for (&pair, products) in pairs {
                    self.add_pair(&eliminated.stations, &motions, pair, products);
                }
                let plane = self.next;
                self.next += 1;
                for (k, (&station, motion)) in eliminated.stations.iter().zip(&motions).enumerate() {
                    let block = eliminated.from_motions.fixed_view::<3, 3>(0, 3 * k) * motion.transpose();
                    self.normal.add(plane, station, |i, j| -block[(i, j)]);
                }
                self.normal.add(plane, plane, |i, j| 0.5 * (of_plane[(i, j)] + of_plane[(j, i)]));
                self.add_right(plane, (-eliminated.from_distances).as_slice());
            }
        }
    }

    fn add_right(&mut self, block: usize, values: &[f64]) {
        let own = self.right.rows_mut(self.normal.start(block), self.normal.width(block));
        own.into_iter().zip(values).for_each(|(sum, value)| *sum += value);
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

    /// What a plane says of the shared parameters.
    fn add_shared(&mut self, eliminated: &Eliminated, products: &DMatrix<f64>, motions: &[Matrix6x3<f64>]) {
        let (first, count) = (3 * motions.len(), self.normal.width(self.stations));
        if count == 0 {
            return;
        }
        for (k, (&station, motion)) in eliminated.stations.iter().zip(motions).enumerate() {
            let block = products.view((first, 3 * k), (count, 3)) * motion.transpose();
            self.normal.add(self.stations, station, |i, j| block[(i, j)]);
        }
        let own = products.view((first, first), (count, count));
        self.normal.add(self.stations, self.stations, |i, j| 0.5 * (own[(i, j)] + own[(j, i)]));
        self.add_right(self.stations, &eliminated.right.as_slice()[first..]);
    }

    /// Adds a relative pose. Along its rows the motion from there, and what shared parameters do where some are given, leaves `right`.
    pub(crate) fn add_relative_pose(
        &mut self,
        RelativePose { stations, first_from_second, rows }: &RelativePose,
        shared: Option<&DMatrix<f64>>,
        right: &DVector<f64>,
        poses: &[Isometry3<f64>],
    ) {
        let (v, by) = relative_pose_parts(first_from_second, &poses[stations[0]], &poses[stations[1]]);
        let (residual, by) = (right - rows * v, by.map(|by| rows * by));
        for (n, (own, &station)) in by.iter().zip(stations).enumerate() {
            for (other_rows, &other) in by.iter().zip(stations).take(n + 1) {
                let block: Matrix6<f64> = own.transpose() * other_rows;
                self.normal.add(station, other, |i, j| block[(i, j)]);
            }
            self.add_right(station, (own.transpose() * &residual).as_slice());
            if let Some(shared) = shared {
                let block = shared.transpose() * own;
                self.normal.add(self.stations, station, |i, j| block[(i, j)]);
            }
        }
        if let Some(shared) = shared {
            let block = shared.transpose() * shared;
            self.normal.add(self.stations, self.stations, |i, j| block[(i, j)]);
            self.add_right(self.stations, (shared.transpose() * &residual).as_slice());
        }
    }

    /// Poses are held where they were by the priors that [`Self::cofactors`] adds.
    pub(crate) fn hold(&mut self, known: Known, at: &[Isometry3<f64>], now: &[Isometry3<f64>]) {
        for station in 0..self.stations {
            let moved = pose_difference(&at[station], &now[station]);
            let weighted: Vec<f64> = (0..6).map(|k| moved[k] * known.weight(k)).collect();
            self.add_right(station, &weighted);
        }
    }

    /// Shared parameters are observed as what is known of them beforehand.
    pub(crate) fn add_prior(&mut self, prior: &Prior, now: &[f64]) {
        let first = self.normal.start(self.stations);
        for (k, ((value, sigma), now)) in prior.0.iter().zip(&prior.1).zip(now).enumerate() {
            // None where nothing is known.
            let weight = sigma.powi(-2);
            self.normal.add_to_diagonal(first + k, weight);
            self.right[first + k] += weight * (now - value);
        }
    }

    /// Adds a turn that was measured between two stations.
    pub(crate) fn add_turn(&mut self, turn: &MeasuredTurn, poses: &[Isometry3<f64>]) {
        if let Some(observed) = turn.observed(poses) {
            self.add_relative_pose(&observed, None, &DVector::zeros(3), poses);
        }
    }

    /// Cofactors, with priors that hold what nothing determines.
    pub(crate) fn cofactors(&self, known: Known) -> Result<Cofactors> {
        let mut normal = self.normal.clone();
        for station in (0..self.stations).filter(|station| self.normal.width(*station) > 0) {
            for k in 0..6 {
                normal.add_to_diagonal(self.normal.start(station) + k, known.weight(k));
            }
        }
        let failed = |why| InputError::Numerical { what: "the normal equations of all stations", why };
        if normal.diagonal().iter().chain(self.right.iter()).any(|value| !value.is_finite()) {
            return Err(failed("they are not finite").into());
        }
        let factor = normal.factor().ok_or(failed("an unknown is not determined"))?;
        Ok(Cofactors::new(factor, (0..=self.stations + 1).map(|block| normal.start(block)).collect()))
    }

    /// The step that minimises the squares: six rows a station, then the shared parameters.
    pub(crate) fn step(&self, cofactors: &Cofactors) -> DVector<f64> {
        let mut step = DVector::zeros(cofactors.unknowns());
        let solved = cofactors.times(&self.right);
        for block in 0..=self.stations {
            let (first, width) = (self.normal.start(block), self.normal.width(block));
            step.rows_mut(6 * block, width).copy_from(&-solved.rows(first, width));
        }
        step
    }
}

#[cfg(test)]
#[path = "../../tests/inside/equations.rs"]
mod tests;
