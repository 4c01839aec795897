//! Normal equations with planes beside the stations against those of eliminated ones, and against the dense solution.

#![allow(clippy::unwrap_used)]

use nalgebra::{Vector3, Vector6};

use super::*;
use crate::adjustment::wide_errors::Derivatives;
use crate::planes::elimination::{SharedPlaneSums, Variances};
use crate::planes::sums::Sums;
use crate::planes::tiles::Tiles;

/// Numbers between −1 and 1 that follow no rule.
fn number(k: usize) -> f64 {
    ((k * 7919 + 13) as f64 * 0.618_034).sin()
}

/// Four planes, of which each of six stations saw some tiles.
fn survey(parameters: usize) -> (Vec<SharedPlane>, Vec<Sums>, Vec<Isometry3<f64>>) {
    let places: Vec<[f64; 2]> = (0..16).map(|k| [0.5 + f64::from(k % 4), 0.5 + f64::from(k / 4)]).collect();
    let normals = [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.6, 0.0, 0.8)];
    let mut planes: Vec<SharedPlane> = normals.iter().map(|normal| SharedPlane::new(normal * -2.0, *normal)).collect();
    let mut first = 0;
    for plane in &mut planes {
        plane.tiles = Tiles::around(&places, 1.0);
        plane.tiles.first = first;
        first += plane.tiles.len();
    }
    let of = |station: usize| {
        let mut sums = Sums::new(parameters);
        for (n, plane) in planes.iter().enumerate() {
            for (k, place) in places.iter().enumerate().filter(|(k, _)| !(k + n + station).is_multiple_of(3)) {
                for point in 0..8 {
                    let of = 1000 * station + 100 * n + 10 * k + point;
                    let [u, v] = [place[0] + 0.4 * number(of), place[1] + 0.4 * number(of + 7)];
                    let weight = 1e4 * (2.0 + number(of + 3));
                    let mut phi = vec![1.0, u, v];
                    phi.extend((0..parameters).map(|k| number(of + 11 + k)));
                    sums.add(plane.tiles.at(*place).0, &phi, 0.01 * number(of + 5), weight);
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

/// The inverse of the whole matrix with what holds the poses.
fn inverse(equations: &Equations, known: Known) -> DMatrix<f64> {
    let normal = &equations.normal;
    let mut whole = DMatrix::zeros(normal.order(), normal.order());
    for row in 0..normal.blocks() {
        for column in 0..normal.blocks() {
            let block = normal.block(row, column);
            whole.view_mut((normal.start(row), normal.start(column)), block.shape()).copy_from(&block);
        }
    }
    for k in 0..6 * (equations.stations - 1) {
        whole[(k, k)] += known.weight(k % 6);
    }
    whole.cholesky().unwrap().inverse()
}

/// Rows of a free network without the six of the third of six stations, and without those after the first `count`.
fn without_held(rows: usize, count: usize) -> Vec<usize> {
    (0..rows).filter(|row| !(12..18).contains(row)).take(count).collect()
}

#[test]
fn planes_beside_the_stations_lead_to_the_solution_of_eliminated_ones() {
    let (planes, sums, poses) = survey(0);
    let stations: Vec<usize> = (0..6).collect();
    let known = Known::at(3.0, 3.0);
    let variances = Variances { surface: 1e-6, shared: 2e-6 };
    let eliminated = |plane: usize, most: usize| {
        let seen = SharedPlaneSums { shared_plane: &planes[plane], sums: &sums, weights: None };
        seen.eliminated(&stations, variances, most).unwrap()
    };
    let mut dense = Equations::new(6, Some(2), 0, 0);
    (0..planes.len()).for_each(|plane| dense.add(&planes[plane], &eliminated(plane, usize::MAX), &poses));
    let expected_cofactors = inverse(&dense, known);
    let expected = -(&expected_cofactors * &dense.right);
    // All eliminated, none, and two of each.
    for beside in [0, 4, 2] {
        let mut sparse = Equations::new(6, Some(2), 0, beside);
        for (plane, shared_plane) in planes.iter().enumerate() {
            let most = if plane < beside { 1 } else { usize::MAX };
            let own = eliminated(plane, most);
            sparse.add(shared_plane, &own, &poses);
            // What the plane does follows from the stations all the same.
            let motions = DVector::from_fn(18, |k, _| number(k));
            let plain = eliminated(plane, usize::MAX).plane(&motions);
            assert!((own.plane(&motions) - plain).norm() < 1e-9 * plain.norm());
        }
        let cofactors = sparse.cofactors(known).unwrap();
        let rows = without_held(36, 30);
        let step = sparse.step(&cofactors);
        assert!((step.select_rows(&rows) - &expected).norm() < 1e-9 * expected.norm(), "{beside}: {step} {expected}");
        assert!(step.rows(12, 6).norm() < 1e-300, "held");
        let whole = cofactors.whole();
        let free = whole.select_rows(&rows).select_columns(&rows);
        assert!((free - &expected_cofactors).norm() < 1e-9 * expected_cofactors.norm(), "{beside}");
        assert!((cofactors.between(1, 4) - whole.fixed_view::<6, 6>(6, 24)).norm() < 1e-9 * whole.norm());
        assert!(cofactors.between(1, 2).norm() < 1e-300, "held");
    }
}

#[test]
fn parameters_that_all_stations_share_are_solved_with_them() {
    let (planes, sums, poses) = survey(2);
    let (stations, known): (Vec<usize>, Known) = ((0..6).collect(), Known::at(3.0, 3.0));
    let variances = Variances { surface: 1e-6, shared: 2e-6 };
    let mut equations = Equations::new(6, Some(2), 2, 0);
    for shared_plane in &planes {
        let seen = SharedPlaneSums { shared_plane, sums: &sums, weights: None };
        equations.add(shared_plane, &seen.eliminated(&stations, variances, usize::MAX).unwrap(), &poses);
    }
    equations.add_prior(&(vec![0.1, 0.2], vec![f64::INFINITY, 1e-3]), &[0.1, 0.203]);
    let expected_cofactors = inverse(&equations, known);
    let expected = -(&expected_cofactors * &equations.right);
    let cofactors = equations.cofactors(known).unwrap();
    let rows = without_held(38, 32);
    let step = equations.step(&cofactors);
    assert!((step.select_rows(&rows) - &expected).norm() < 1e-9 * expected.norm(), "{step} {expected}");
    let free = cofactors.whole().select_rows(&rows).select_columns(&rows);
    assert!((free - &expected_cofactors).norm() < 1e-9 * expected_cofactors.norm());
    let derivatives = Derivatives {
        poses: [(1, Vector6::from_fn(|k, _| number(k))), (4, Vector6::from_fn(|k, _| number(k + 9)))].into(),
        parameters: DVector::from_column_slice(&[0.7, -0.4]),
    };
    let mut all = DVector::zeros(38);
    derivatives.poses.iter().for_each(|(station, own)| all.fixed_rows_mut::<6>(6 * station).copy_from(own));
    all.rows_mut(36, 2).copy_from(&derivatives.parameters);
    let variance = all.dot(&(cofactors.whole() * &all));
    assert!((cofactors.variance(&derivatives) - variance).abs() < 1e-9 * variance);
}
