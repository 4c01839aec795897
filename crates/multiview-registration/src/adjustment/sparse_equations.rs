//! The normal equations of a large network, of whose blocks few are filled.
//!
//! A plane that a few stations saw is eliminated as in small networks, and couples them with each other. One that very many saw, as
//! the floor of a building, stays beside them: eliminated, it would fill the whole matrix.

use nalgebra::{DVector, Dyn, Isometry3, Matrix3, Matrix6, Matrix6x3, OMatrix, U6};
use rigid_pose::pose_difference;
use sparse_matrices::BlockMatrix;

use crate::adjustment::cofactors::Cofactors;
use crate::adjustment::network::Network;
use crate::adjustment::turns::MeasuredTurn;
use crate::error::{Error, Result};
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
        let stations = [turn.first, turn.second];
        for (n, (row, station)) in by.iter().zip(stations).enumerate() {
            for (column, other) in by.iter().zip(stations).take(n + 1) {
                let block = row.transpose() * column;
                self.normal.add(station, other, |i, j| block[(i, j)]);
            }
            if self.normal.width(station) > 0 {
                let mut right = self.right.fixed_rows_mut::<6>(self.normal.start(station));
                right += row.transpose() * residual;
            }
        }
    }

    /// Cofactors, with priors that hold what nothing determines.
    pub(crate) fn cofactors(&self, network: &Network<'_>) -> Result<Cofactors> {
        let mut normal = self.normal.clone();
        for station in (0..self.stations).filter(|station| self.normal.width(*station) > 0) {
            for k in 0..6 {
                normal.add_to_diagonal(self.normal.start(station) + k, network.hold_weight(k));
            }
        }
        let failed = |why| Error::Numerical { what: "the normal equations of all stations", why };
        if normal.diagonal().iter().chain(self.right.iter()).any(|value| !value.is_finite()) {
            return Err(failed("they are not finite"));
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
mod tests {
    #![allow(clippy::unwrap_used)]

    use nalgebra::Vector3;

    use super::*;
    use crate::adjustment::equations::Equations;
    use crate::adjustment::network::State;
    use crate::planes::elimination::{SharedPlaneSums, Variances};
    use crate::planes::sums::Sums;
    use crate::planes::tiles::Tiles;

    /// Numbers between −1 and 1 that follow no rule.
    fn number(k: usize) -> f64 {
        ((k * 7919 + 13) as f64 * 0.618_034).sin()
    }

    /// Four planes, of which each of six stations saw some tiles.
    fn survey() -> (Vec<SharedPlane>, Vec<Sums>, Vec<Isometry3<f64>>) {
        let places: Vec<[f64; 2]> = (0..16).map(|k| [0.5 + f64::from(k % 4), 0.5 + f64::from(k / 4)]).collect();
        let normals = [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, 0.8)];
        let mut planes: Vec<SharedPlane> =
            normals.iter().map(|normal| SharedPlane::new(normal * -2.0, *normal)).collect();
        let mut first = 0;
        for plane in &mut planes {
            plane.tiles = Tiles::around(&places, 1.0);
            plane.tiles.first = first;
            first += plane.tiles.len();
        }
        let of = |station: usize| {
            let mut sums = Sums::new(0);
            for (n, plane) in planes.iter().enumerate() {
                for (k, place) in places.iter().enumerate().filter(|(k, _)| !(k + n + station).is_multiple_of(3)) {
                    for point in 0..8 {
                        let of = 1000 * station + 100 * n + 10 * k + point;
                        let [u, v] = [place[0] + 0.4 * number(of), place[1] + 0.4 * number(of + 7)];
                        let weight = 1e4 * (2.0 + number(of + 3));
                        sums.add(plane.tiles.at(*place).0, &[1.0, u, v], 0.01 * number(of + 5), weight);
                    }
                }
            }
            sums.close();
            sums
        };
        let pose =
            |k: usize| Isometry3::new(Vector3::new(number(k), number(k + 1), number(k + 2)), Vector3::z() * number(k));
        ((planes.clone()), (0..6).map(of).collect(), (0..6).map(pose).collect())
    }

    #[test]
    fn planes_beside_the_stations_lead_to_the_solution_of_eliminated_ones() {
        let (planes, sums, poses) = survey();
        let stations: Vec<usize> = (0..6).collect();
        let prior = (Vec::new(), Vec::new());
        let network =
            Network { fixed: 2, hold_m: 3.0, turn_rad: 1.0, names: &[], prior: &prior, turns: &[], whole: false };
        let variances = Variances { surface: 1e-6, shared: 2e-6 };
        let eliminated = |plane: usize, most: usize| {
            let seen = SharedPlaneSums { shared_plane: &planes[plane], sums: &sums, weights: None };
            seen.eliminated(&stations, variances, most).unwrap()
        };
        let mut dense = Equations::new(6, 0);
        (0..planes.len()).for_each(|plane| dense.add(&planes[plane], &eliminated(plane, usize::MAX), &poses));
        let state = State { poses: poses.clone(), parameters: Vec::new() };
        let (expected, expected_cofactors) = dense.solved(&network, &state).unwrap();
        let expected_cofactors = expected_cofactors.whole();
        // All eliminated, none, and two of each.
        for beside in [0, 4, 2] {
            let mut sparse = SparseEquations::new(6, 2, beside);
            for (plane, shared_plane) in planes.iter().enumerate() {
                let most = if plane < beside { 1 } else { usize::MAX };
                let own = eliminated(plane, most);
                sparse.add(shared_plane, &own, &poses);
                // What the plane does follows from the stations all the same.
                let motions = DVector::from_fn(18, |k, _| number(k));
                let plain = eliminated(plane, usize::MAX).plane(&motions);
                assert!((own.plane(&motions) - plain).norm() < 1e-9 * plain.norm());
            }
            let cofactors = sparse.cofactors(&network).unwrap();
            let step = sparse.step(&cofactors);
            assert!((&step - &expected).norm() < 1e-9 * expected.norm(), "{beside}: {step} {expected}");
            let whole = cofactors.whole();
            assert!((&whole - &expected_cofactors).norm() < 1e-9 * expected_cofactors.norm(), "{beside}");
            assert!(
                (cofactors.between(1, 4) - expected_cofactors.fixed_view::<6, 6>(6, 24)).norm() < 1e-9 * whole.norm()
            );
            assert!(cofactors.between(1, 2).norm() < 1e-300, "held");
        }
    }
}
