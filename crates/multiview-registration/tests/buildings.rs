//! More stations than a normal matrix is factorised as a whole for.

use crate::common::stations::round;
use crate::common::{disturbance, pose_error};
use multiview_registration::{Datum, Error, Placement, Start, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;

#[test]
fn forty_two_stations_come_where_forty_of_them_do() {
    let (clouds, truth) = round(42, 0.01, 3);
    // One is a step away from where it was.
    let off = |k: usize| if k == 17 { disturbance(0.3, 3.0, 5) } else { disturbance(0.05, 2.0, 70 + k as u64) };
    let start: Vec<Isometry3<f64>> =
        truth.iter().enumerate().map(|(k, pose)| if k == 0 { *pose } else { pose * off(k) }).collect();
    let found = |count: usize| {
        let (clouds, start) = (&clouds[..count], Start::Poses(&start[..count]));
        register_stations(clouds, start, Datum::Station(0), &StationRegistrationOptions::default(), &|_, _| {}).unwrap()
    };
    let (many, few) = (found(42), found(40));
    assert!(many.settled && many.undetermined.is_empty());
    // Fewer blocks than all pairs were not asked for: all stand in one room.
    let mut squares = 0.0;
    for k in 1..42 {
        assert_eq!(many.placements.stations[k].verdict, Placement::Placed, "{k}");
        let (mm, degrees) = pose_error(&many.world_from_station[k], &truth[k]);
        assert!(mm < 2.0 && degrees < 0.05, "{k}: {mm} mm {degrees} deg");
        if k < 40 {
            // Two stations more, and other priors in the rounds before the last.
            let (mm, degrees) = pose_error(&many.world_from_station[k], &few.world_from_station[k]);
            assert!(mm < 1.0 && degrees < 0.03, "{k}: {mm} mm {degrees} deg from where few come");
            let [one, other] = [&many, &few].map(|found| found.covariance[k].fixed_view::<3, 3>(0, 0).trace());
            assert!((0.5..1.5).contains(&(one / other)), "{k}: variances {one} and {other}");
        }
        let (pose, covariance) = many.relative_pose(k - 1, k).unwrap();
        let error = rigid_pose::pose_difference(&(truth[k - 1].inverse() * truth[k]), &pose);
        squares += error.dot(&covariance.cholesky().unwrap().solve(&error)) / 41.0;
    }
    // Six expected; 41 of them, not independent, scatter by half of one.
    println!("normalised squared error {squares}");
    assert!((4.0..8.5).contains(&squares), "{squares}");
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
    let ordered = refused(201, Start::Order);
    assert!(matches!(ordered, Error::TooManyStations { found: 201, most: 200, .. }));
    assert!(ordered.to_string().contains("give approximate poses"), "{ordered}");
}
