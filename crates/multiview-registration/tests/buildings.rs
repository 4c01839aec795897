//! How many stations are taken at once, and what they looked through.

use global_registration::FreeSpace;
use multiview_registration::{Datum, Error, Start, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;

#[test]
fn more_stations_than_have_been_shown_are_refused() {
    let cloud = Cloud::new(vec![Point3::origin()]);
    let options = StationRegistrationOptions::default();
    let refused = |count: usize, start: Start<'_>| {
        let clouds = vec![cloud.clone(); count];
        register_stations(&clouds, start, Datum::Station(0), &options, &|_, _| {}).unwrap_err()
    };
    let poses = vec![Isometry3::identity(); 1001];
    assert!(matches!(refused(1001, Start::Poses(&poses)), Error::TooManyStations { found: 1001, most: 1000, .. }));
    let ordered = refused(201, Start::Order);
    assert!(matches!(ordered, Error::TooManyStations { found: 201, most: 200, .. }));
    assert!(ordered.to_string().contains("give approximate poses"), "{ordered}");
}

#[test]
fn rays_went_as_far_as_what_was_seen_and_no_farther() {
    // A wall 3 m ahead with a hole in it, through which another one is seen 5 m ahead; pixels of 10 mrad.
    let is_hole = |x: f64, y: f64| x.abs() < 0.1 && y.abs() < 0.1;
    let ray = |k: i32| {
        let (x, y) = (0.01 * f64::from(k % 100 - 50), 0.01 * f64::from(k / 100 - 50));
        let depth = if is_hole(x, y) { 5.0 } else { 3.0 };
        let point = Point3::new(x * depth, y * depth, -depth);
        (point, point.coords.norm() - 0.05)
    };
    let seen: Vec<(Point3<f64>, f64)> = (0..10_000).map(ray).collect();
    let space = FreeSpace::new(&seen);
    let at = |x: f64, y: f64, depth: f64| space.holds(&Point3::new(x * depth, y * depth, -depth));
    assert!(at(0.3, 0.2, 2.9) && !at(0.3, 0.2, 2.99) && !at(0.3, 0.2, 3.5), "before the wall, on it, behind it");
    assert!(at(0.0, 0.0, 3.0) && at(0.05, -0.05, 4.9) && !at(0.0, 0.0, 5.0), "through the hole");
    assert!(!at(0.095, 0.0, 3.0), "beside its edge nothing is certain");
    assert!(!at(0.8, 0.0, 1.0) && !space.holds(&Point3::new(0.0, 0.0, 1.0)), "where nothing was seen nothing is known");
    assert!(
        !space.holds(&Point3::new(f64::NAN, 0.0, -1.0)) && !FreeSpace::new(&[]).holds(&Point3::new(0.0, 0.0, -1.0))
    );
}
