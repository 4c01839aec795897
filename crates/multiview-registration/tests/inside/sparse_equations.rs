//! Sparse normal equations against whole ones.

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
    let mut planes: Vec<SharedPlane> = normals.iter().map(|normal| SharedPlane::new(normal * -2.0, *normal)).collect();
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
    let network = Network { fixed: 2, hold_m: 3.0, turn_rad: 1.0, names: &[], prior: &prior, turns: &[], whole: false };
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
        assert!((cofactors.between(1, 4) - expected_cofactors.fixed_view::<6, 6>(6, 24)).norm() < 1e-9 * whole.norm());
        assert!(cofactors.between(1, 2).norm() < 1e-300, "held");
    }
}
