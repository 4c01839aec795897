//! Buildings of many stations: sparse normal equations, and how the effort grows.

use multiview_registration::{Datum, Start, StationRegistration, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;
use point_cloud::Cloud;
use rigid_pose::pose_difference;

use crate::building::{Building, Camera};

const CAMERA: Camera = Camera { width: 64, height: 48 };

fn clouds(building: &Building) -> Vec<Cloud> {
    (0..building.stations.len()).map(|station| building.cloud(station, CAMERA, 1)).collect()
}

fn registered(clouds: &[Cloud], poses: &[Isometry3<f64>]) -> StationRegistration {
    let options = StationRegistrationOptions::default();
    register_stations(clouds, Start::Poses(poses), Datum::Station(0), &options, &|_, _| {}).unwrap()
}

#[test]
fn a_building_comes_together_from_coarse_poses() {
    let building = Building::new(44, 1);
    let found = registered(&clouds(&building), &building.approximate(0.05, 1.5, 1));
    assert!(found.settled);
    let mut squares = 0.0;
    for station in 1..building.stations.len() {
        let (pose, covariance) = found.relative_pose(station - 1, station).unwrap();
        let error = pose_difference(&(building.stations[station - 1].inverse() * building.stations[station]), &pose);
        squares += error.dot(&covariance.cholesky().unwrap().solve(&error));
        // Sparse or whole, blocks of one covariance.
        let own = found.joint_covariance.between(station, station);
        assert!((own - found.covariance[station]).norm() < 1e-12 * own.norm());
    }
    let mean = squares / (building.stations.len() - 1) as f64;
    println!("{mean:.2}");
    // Six are expected.
    assert!((2.0..14.0).contains(&mean), "{mean}");
}

#[test]
fn the_effort_grows_with_the_number_of_stations() {
    let effort = |count: usize| {
        let building = Building::new(count, 1);
        registered(&clouds(&building), &building.approximate(0.03, 1.0, 1)).effort
    };
    let (few, many) = (effort(44), effort(110));
    // Two and a half times as many: all pairs would be 6.3 times as many, as would be the blocks of a dense matrix.
    assert!((many.pairs_tried as f64) < 3.8 * few.pairs_tried as f64, "{few:?} {many:?}");
    assert!((many.filled_blocks as f64) < 3.8 * few.filled_blocks as f64, "{few:?} {many:?}");
}
