//! Shared parameters of the points, estimated with the poses.
use crate::common::pose_error;
use crate::common::stations::round;
use multiview_registration::{Datum, PointModel, Start, StationRegistrationOptions, register_stations};
use nalgebra::Point3;
use point_cloud::Cloud;

/// Ranges that are off by `offset + scale · range`: points are the observed ones with that taken off.
struct RangeTerms<'a> {
    observed: &'a [Cloud],
    prior_sigma: [f64; 2],
}

impl PointModel for RangeTerms<'_> {
    fn names(&self) -> Vec<String> {
        vec!["offset".to_owned(), "scale".to_owned()]
    }

    fn prior(&self) -> (Vec<f64>, Vec<f64>) {
        (vec![0.0; 2], self.prior_sigma.to_vec())
    }

    fn point(
        &self,
        station: usize,
        index: usize,
        parameters: &[f64],
        derivatives: Option<&mut [[f64; 3]]>,
    ) -> Point3<f64> {
        let point = self.observed[station].points[index].coords;
        let range = point.norm();
        let ray = point / range;
        if let Some(derivatives) = derivatives {
            derivatives[0] = (-ray).into();
            derivatives[1] = (-point).into();
        }
        Point3::from(ray * (range - parameters[0] - parameters[1] * range))
    }
}

#[test]
fn a_range_offset_is_found_with_the_poses() {
    let (mut clouds, truth) = round(8, 0.0, 11);
    for cloud in &mut clouds {
        for point in &mut cloud.points {
            point.coords += point.coords.normalize() * 0.010;
        }
    }
    let model = RangeTerms { observed: &clouds, prior_sigma: [f64::INFINITY, 0.002] };
    let options = StationRegistrationOptions { model: Some(&model), ..StationRegistrationOptions::default() };
    let found = register_stations(&clouds, Start::Poses(&truth), Datum::Station(0), &options, &|_, _| {}).unwrap();
    let parameters = found.parameters.as_ref().unwrap();
    let sigma = parameters.sigma();
    assert_eq!(parameters.names, ["offset", "scale"]);
    // Within four of its standard deviations, and these are below a tenth of the offset.
    assert!((parameters.values[0] - 0.010).abs() < 4.0 * sigma[0], "{:?} {sigma:?}", parameters.values);
    assert!(sigma[0] > 0.0 && sigma[0] < 1e-3, "{sigma:?}");
    assert!(parameters.significance[0] > 10.0);
    assert!(parameters.values[1].abs() < 4.0 * sigma[1], "{:?} {sigma:?}", parameters.values);
    assert!(parameters.largest_pose_correlation.iter().all(|(station, _, r)| *station > 0 && r.abs() <= 1.0 + 1e-9));
    assert!(found.settled);
    let world = truth[0] * found.world_from_station[0].inverse();
    for (pose, truth) in found.world_from_station.iter().zip(&truth) {
        let (mm, degrees) = pose_error(&(world * pose), truth);
        // The bar of the room without range errors.
        assert!(mm < 3.0 && degrees < 0.1, "{mm} mm {degrees} deg");
    }
}
