//! Many stations of a building with small frames, through all that is done with networks of many stations.

#![allow(clippy::unwrap_used)]

use std::sync::OnceLock;

use nalgebra::DVector;
use rigid_pose::pose_difference;

use super::*;
use crate::adjustment::equations::Equations;
use crate::adjustment::joint_covariance::JointCovariance;
use crate::places::joints::Weakest;
use plan::{Building, Camera};
use rigid_pose::{relative_jacobians, step_pose};

#[path = "../../examples/building/plan.rs"]
mod plan;

/// Of a building of 44 stations those of one room: few and small enough for a test, and sound in the dense way.
const FIRST: usize = 8;
const STATIONS: usize = 14;
const CAMERA: Camera = Camera { width: 112, height: 84 };

struct Survey {
    truth: Vec<Isometry3<f64>>,
    clouds: Vec<Cloud>,
    start: Vec<Isometry3<f64>>,
}

impl Survey {
    fn new(seed: u64) -> Self {
        let building = Building::new(44, seed);
        let part = FIRST..FIRST + STATIONS;
        let clouds = part.clone().map(|station| building.cloud(station, CAMERA, seed)).collect();
        let start = building.approximate(0.1, 3.0, seed)[part.clone()].to_vec();
        Self { truth: building.stations[part].to_vec(), clouds, start }
    }

    fn brought(&self, whole: bool) -> Brought<'static> {
        let options = StationRegistrationOptions::default();
        let start = Start::Poses(&self.start);
        brought_together(&self.clouds, start, Datum::Station(0), (&options, whole), &|_, _| {}).unwrap()
    }
}

/// The survey by the way of many stations; both tests look at it.
fn sparse() -> &'static (Survey, Brought<'static>) {
    static DONE: OnceLock<(Survey, Brought<'static>)> = OnceLock::new();
    DONE.get_or_init(|| {
        let survey = Survey::new(3);
        let brought = survey.brought(false);
        (survey, brought)
    })
}

fn joint(brought: &Brought) -> JointCovariance {
    JointCovariance::new(brought.adjusted.cofactors.clone(), brought.adjusted.factor)
}

#[test]
fn many_stations_come_where_the_whole_matrix_has_them() {
    let (survey, sparse) = sparse();
    let dense = survey.brought(true);
    let (poses, truth) = (&sparse.adjusted.state.poses, &survey.truth);
    let (of_sparse, of_dense) = (joint(sparse), joint(&dense));
    let mut squares = 0.0;
    for station in 1..STATIONS {
        let (pose, covariance) = of_sparse.relative_pose(poses, 0, station);
        let (other, of_other) = of_dense.relative_pose(&dense.adjusted.state.poses, 0, station);
        let factor = covariance.cholesky().unwrap();
        let square = |off: nalgebra::Vector6<f64>| off.dot(&factor.solve(&off));
        squares += square(pose_difference(&pose, &(truth[0].inverse() * truth[station]))) / (STATIONS - 1) as f64;
        // Points near edges go to one plane or the other as rounds happened to end: some tenths of the deviations.
        let apart = square(pose_difference(&pose, &other));
        assert!(apart < 2.0, "{station}: {apart}");
        let ratio = covariance.trace() / of_other.trace();
        assert!((0.8..1.25).contains(&ratio), "{station}: {ratio}");
    }
    // Six are expected; the stations share their datum.
    assert!((2.0..14.0).contains(&squares), "{squares}");
    assert!(sparse.adjusted.settled);
    assert_eq!(sparse.placements.as_ref().unwrap().doubtful().count(), 0);
}

#[test]
fn a_station_in_a_wrong_place_is_named_and_put_back() {
    let (_, Brought { adjusted, start, points, network, patch_m, .. }) = sparse();
    let places = Places::new(adjusted, points, start, network, (*patch_m, START_ERROR * network.hold_m));
    let right = &adjusted.state.poses;
    assert!(places.looked_through.doubtful(right).is_empty());
    let wrong = 7;
    let moved_by = |x: f64, y: f64| {
        let mut poses = right.clone();
        poses[wrong] = Isometry3::translation(x, y, 0.0) * poses[wrong];
        poses
    };
    // By 16 cm: three pixels.
    assert_eq!(places.looked_through.doubtful(&moved_by(0.12, 0.1)), [wrong]);
    let mut poses = moved_by(0.05, 0.04);
    let moved = places.improved(&mut poses, &mut Vec::new(), None).unwrap().0;
    assert_eq!(moved.into_iter().collect::<Vec<usize>>(), [wrong]);
    let off_m = (poses[wrong].translation.vector - right[wrong].translation.vector).norm();
    assert!(off_m < 0.01, "{off_m}");
}

#[test]
fn what_lies_beyond_a_joint_comes_where_no_rays_go_through_it() {
    let (_, Brought { adjusted, start, points, network, patch_m, .. }) = sparse();
    let places = Places::new(adjusted, points, start, network, (*patch_m, START_ERROR * network.hold_m));
    let right = &adjusted.state.poses;
    let beyond: Vec<bool> = (0..STATIONS).map(|station| station >= 9).collect();
    let mut poses = right.clone();
    // By three pixels along the floor, as if nothing held what lies beyond.
    poses[9..].iter_mut().for_each(|pose| *pose = Isometry3::translation(0.08, 0.06, 0.0) * *pose);
    let along = (poses[8].inverse() * Vector3::new(0.8, 0.6, 0.0)).push(0.0).push(0.0).push(0.0);
    let weakest = Weakest { stations: [8, 9], tangent: along, metres: along, sigma_m: 1.0 };
    let mut joints = Vec::new();
    assert!(places.slid(&weakest, &beyond, &mut poses, &mut joints));
    assert_eq!(joints.len(), 1);
    let joint = joints[0].clone();
    let sigma_m = joint.rows.norm().recip();
    for station in 9..STATIONS {
        let off_m = (poses[station].translation.vector - right[station].translation.vector).norm();
        assert!(off_m < 3.0 * sigma_m && off_m < 0.02, "{station}: {off_m}, {joint:?}");
    }
    // What is known already moves nothing.
    let known = joints.clone();
    assert!(!places.slid(&weakest, &beyond, &mut poses, &mut joints) && joints == known);
    // It holds the two as surfaces do not.
    let mut equations = Equations::new(STATIONS, Some(8), 0, 0);
    equations.add_relative_pose(&joint, None, &DVector::zeros(1), right);
    let cofactors = equations.cofactors(network.held()).unwrap();
    let by_second = relative_jacobians(&right[8], &(right[8].inverse() * right[9]))[1];
    let of_joint = along.dot(&(by_second * cofactors.of(9) * by_second.transpose() * along));
    assert!((of_joint.sqrt() / sigma_m - 1.0).abs() < 1e-3, "{of_joint} {joints:?}");
    let step = equations.step(&cofactors);
    let moved = step_pose(&right[9], &step.fixed_rows::<6>(54).into_owned());
    let off_m = (moved.translation.vector - poses[9].translation.vector).norm();
    assert!(off_m < 1e-3, "{off_m}");
}
