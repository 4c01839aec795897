//! Stations that are held by one of them against those that only anchors hold.

#![allow(clippy::unwrap_used)]

use nalgebra::{DMatrix, Vector3};

use super::*;

#[test]
fn stations_without_a_held_one_come_where_those_with_one_do() {
    let number = |k: usize| ((k * 7919 + 13) as f64 * 0.618_034).sin();
    let vector = |k: usize| Vector3::new(number(k), number(k + 1), number(k + 2));
    let poses: Vec<Isometry3<f64>> = (0..6).map(|k| Isometry3::new(3.0 * vector(5 * k), vector(7 * k + 3))).collect();
    let pair = |target: usize, source: usize| {
        let off = Isometry3::new(0.03 * vector(target + 9 * source), 0.02 * vector(4 * target + source));
        let pose = poses[target].inverse() * poses[source];
        // What was observed is off the present poses by centimetres.
        let right = DVector::from_fn(6, |k, _| 300.0 * number(11 * target + 3 * source + k));
        let rows =
            DMatrix::from_fn(6, 6, |r, c| 1e4 * (f64::from(u8::from(r == c)) + 0.3 * number(r + 6 * c + target)));
        let contacts = PairContacts { target, source, contacts: Vec::new() };
        (contacts, Reduced { rows, right, pose: pose * off })
    };
    let all: Vec<(PairContacts, Reduced)> =
        [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (0, 5), (1, 4)].map(|(a, b)| pair(a, b)).into();
    let pairs: Vec<(&PairContacts, Reduced)> = all.iter().map(|(pair, reduced)| (pair, reduced.clone())).collect();
    let turn = MeasuredTurn {
        first: 0,
        second: 3,
        first_from_second: poses[0].rotation.inverse()
            * poses[3].rotation
            * nalgebra::UnitQuaternion::from_scaled_axis(0.01 * vector(3)),
        covariance: nalgebra::Matrix3::identity() * 1e-6,
    };
    let (prior, turns) = ((Vec::new(), Vec::new()), [turn]);
    let network = Network { fixed: 2, hold_m: 3.0, names: Vec::new(), prior, turns: &turns, whole: true };
    let state = State { poses: poses.clone(), parameters: Vec::new() };
    let held = Anchors { fixed: Some(2), poses: &poses, known: network.held(), factor: 1.0 };
    let solved = |anchors: &Anchors<'_>, steps: usize| {
        (0..steps).fold(state.clone(), |state, _| network.solve(&state, &pairs, anchors).unwrap())
    };
    let few = solved(&held, 24);
    assert!(largest_step(&state, &few, 3.0) > 0.02);
    let off = |many: &State| {
        // Nothing but the anchors holds the frame.
        let moved = few.poses[2] * many.poses[2].inverse();
        let poses = many.poses.iter().map(|pose| moved * pose).collect();
        largest_step(&few, &State { poses, parameters: Vec::new() }, 3.0)
    };
    let anchors = Anchors { fixed: None, ..held };
    // A millionth of the radius.
    assert!(off(&solved(&held, 6)) < 3e-6 && off(&solved(&anchors, 6)) < 3e-6);
}
