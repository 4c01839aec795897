//! Input without an answer.
use multiview_registration::Error;
use multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;
use point_cloud::Error as CloudError;
use rigid_pose::InputError;

fn plane() -> Cloud {
    Cloud::new((0..400).map(|i| Point3::new(f64::from(i % 20) * 0.02, f64::from(i / 20) * 0.02, -1.0)).collect())
}

fn error(stations: &[Cloud], start: Start<'_>, datum: Datum, options: &StationRegistrationOptions<'_>) -> Error {
    register_stations(stations, start, datum, options, &|_, _| {}).unwrap_err()
}

#[test]
fn what_is_wrong_is_named() {
    let options = StationRegistrationOptions::default();
    let (two, poses) = ([plane(), plane()], [Isometry3::identity(); 2]);
    let none: [Cloud; 0] = [];
    assert!(matches!(
        error(&none, Start::Poses(&[]), Datum::Station(0), &options),
        Error::Input(InputError::Empty { .. })
    ));
    let short = Start::Poses(&poses[..1]);
    assert!(matches!(error(&two, short, Datum::Station(0), &options), Error::Input(InputError::LengthMismatch { .. })));
    let start = Start::Poses(&poses);
    assert!(matches!(error(&two, start, Datum::Station(2), &options), Error::NoSuchStation { station: 2, count: 2 }));
    let mut nan = poses;
    nan[1].translation.vector.x = f64::NAN;
    assert!(matches!(
        error(&two, Start::Poses(&nan), Datum::Station(0), &options),
        Error::Input(InputError::NonFinite { index: 1, .. })
    ));
    let holed = [plane(), Cloud::new(vec![Point3::new(f64::NAN, 0.0, 0.0)])];
    assert!(matches!(
        error(&holed, start, Datum::Station(0), &options),
        Error::Cloud(CloudError::Input(InputError::NonFinite { .. }))
    ));
    let empty = [plane(), Cloud::default()];
    assert!(matches!(
        error(&empty, start, Datum::Station(0), &options),
        Error::Cloud(CloudError::Input(InputError::Empty { .. }))
    ));
}

#[test]
fn options_outside_their_domain_are_refused() {
    let (two, poses) = ([plane(), plane()], [Isometry3::identity(); 2]);
    let default = StationRegistrationOptions::default;
    let wrong = [
        StationRegistrationOptions { patch_m: Some(0.0), ..default() },
        StationRegistrationOptions { start_error_m: Some(f64::NAN), ..default() },
        StationRegistrationOptions { minimum_overlap: 1.5, ..default() },
    ];
    for options in &wrong {
        let found = error(&two, Start::Poses(&poses), Datum::Station(0), options);
        assert!(matches!(found, Error::Input(InputError::InvalidOption { .. })), "{options:?}: {found}");
    }
}

#[test]
fn points_that_form_no_surface_are_too_few() {
    let line = Cloud::new((0..100).map(|i| Point3::new(f64::from(i) * 0.01, 0.0, -1.0)).collect());
    let dot = Cloud::new(vec![Point3::new(0.0, 0.0, -1.0); 50]);
    for odd in [line, dot] {
        let found = error(
            &[plane(), odd],
            Start::Poses(&[Isometry3::identity(); 2]),
            Datum::Station(0),
            &StationRegistrationOptions::default(),
        );
        assert!(matches!(found, Error::Input(InputError::TooFewPoints { .. })), "{found}");
    }
}

#[test]
fn one_station_is_an_answer() {
    let options = StationRegistrationOptions::default();
    let found =
        register_stations(&[plane()], Start::Poses(&[Isometry3::identity()]), Datum::Station(0), &options, &|_, _| {});
    let found = found.unwrap();
    assert_eq!(found.world_from_station, vec![Isometry3::identity()]);
    assert!(found.surfaces.is_empty() && found.sigma0.is_none());
}
