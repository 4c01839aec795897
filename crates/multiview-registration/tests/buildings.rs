//! Buildings of many stations: sparse normal equations, and how many are taken.

use multiview_registration::{Datum, Error, Start, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;
use rigid_pose::pose_difference;

use crate::building::{Building, Camera};

const CAMERA: Camera = Camera { width: 80, height: 60 };

#[test]
fn a_building_comes_together_from_coarse_poses() {
    let building = Building::new(42, 1);
    let clouds: Vec<Cloud> = (0..42).map(|station| building.cloud(station, CAMERA, 1)).collect();
    let options = StationRegistrationOptions { start_error_m: Some(0.1), ..StationRegistrationOptions::default() };
    let start = building.approximate(0.02, 0.5, 1);
    let found = register_stations(&clouds, Start::Poses(&start), Datum::Station(0), &options, &|_, _| {}).unwrap();
    assert!(found.settled);
    assert_eq!(found.placements.doubtful().count(), 0);
    let mut squares = 0.0;
    for station in 1..42 {
        let (pose, covariance) = found.relative_pose(station - 1, station).unwrap();
        let error = pose_difference(&(building.stations[station - 1].inverse() * building.stations[station]), &pose);
        assert!(error.fixed_rows::<3>(0).norm() < 0.03, "{station}: {error}");
        squares += error.dot(&covariance.cholesky().unwrap().solve(&error));
        // Sparse or whole, blocks of one covariance.
        let own = found.joint_covariance.between(station, station);
        assert!((own - found.covariance[station]).norm() < 1e-12 * own.norm());
    }
    // Six are expected.
    let mean = squares / 41.0;
    assert!((2.0..14.0).contains(&mean), "{mean}");
    // Of 861 pairs of stations.
    assert!(found.effort.pairs_tried < 800 && found.effort.filled_blocks < 861, "{:?}", found.effort);
}

#[test]
fn more_stations_than_have_been_shown_are_refused() {
    let cloud = Cloud::new(vec![Point3::origin()]);
    let options = StationRegistrationOptions::default();
    let refused = |count: usize, start: Start<'_>| {
        let clouds = vec![cloud.clone(); count];
        register_stations(&clouds, start, Datum::Station(0), &options, &|_, _| {}).unwrap_err()
    };
    let poses = vec![Isometry3::identity(); 201];
    assert!(matches!(refused(201, Start::Poses(&poses)), Error::TooManyStations { found: 201, most: 200, .. }));
    let ordered = refused(41, Start::Order);
    assert!(matches!(ordered, Error::TooManyStations { found: 41, most: 40, .. }));
    assert!(ordered.to_string().contains("give approximate poses"), "{ordered}");
}
