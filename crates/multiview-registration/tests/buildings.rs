//! How many stations are taken at once.

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
    let poses = vec![Isometry3::identity(); 201];
    assert!(matches!(refused(201, Start::Poses(&poses)), Error::TooManyStations { found: 201, most: 200, .. }));
    let ordered = refused(201, Start::Order);
    assert!(matches!(ordered, Error::TooManyStations { found: 201, most: 200, .. }));
    assert!(ordered.to_string().contains("give approximate poses"), "{ordered}");
}
