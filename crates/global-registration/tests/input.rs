//! Input of an alignment without a guess that has no answer gets a typed one.

use crate::common::{Pinhole, Scene};
use crate::scenes::{Outcome, align_points, outcome, pair};
use global_registration::Error;
use global_registration::{CoarseOptions, FeatureCloud, SharedError, Viewpoint, align_without_guess};
use nalgebra::{Isometry3, Point3};
use point_cloud::Cloud;
use point_cloud::Error as CloudError;
use rigid_pose::InputError;

fn made(points: Vec<Point3<f64>>) -> Result<FeatureCloud, Error> {
    FeatureCloud::new(&Cloud::new(points), &CoarseOptions::default())
}

/// Two frames with half of the view in common.
fn frames() -> ([Vec<[f64; 3]>; 2], Isometry3<f64>) {
    let (scene, camera) = (Scene::furnished(), Pinhole::small());
    let pair = pair(&scene, &camera, 0.45..0.6, 0);
    (pair.points(&scene, &camera), pair.target_from_source())
}

#[test]
fn clouds_without_extent_are_named() {
    assert!(matches!(made(vec![]), Err(Error::Cloud(CloudError::Input(InputError::Empty { .. })))));
    assert!(matches!(
        made(vec![Point3::new(f64::NAN, 0.0, 0.0); 20]),
        Err(Error::Cloud(CloudError::Input(InputError::NonFinite { index: 0, .. })))
    ));
    let unseen = Cloud::from_frame(&[[f64::NAN; 3]; 400], None, None).unwrap();
    assert!(matches!(
        FeatureCloud::new(&unseen, &CoarseOptions::default()),
        Err(Error::Cloud(CloudError::Input(InputError::Empty { .. })))
    ));
    assert!(matches!(made(vec![Point3::new(0.0, 0.0, -1.0)]), Err(Error::Input(InputError::TooFewPoints { .. }))));
    assert!(matches!(made(vec![Point3::origin(); 50]), Err(Error::Input(InputError::TooFewPoints { .. }))));
    let far = vec![Point3::new(0.0, 0.0, 0.0), Point3::new(1e99, 0.0, 0.0), Point3::new(0.0, -1e99, 1.0)];
    assert!(matches!(made(far), Err(Error::Input(InputError::TooFewPoints { .. }))));
}

#[test]
fn lines_and_planes_have_no_pose() {
    let line = made((0..500).map(|k| Point3::new(f64::from(k) * 0.01, 0.0, -1.0)).collect()).unwrap();
    let plane =
        made((0..4000).map(|k| Point3::new(f64::from(k % 80) * 0.02, f64::from(k / 80) * 0.02, -1.0)).collect());
    let plane = plane.unwrap();
    let ([frame, _], _) = frames();
    let frame = made(frame.into_iter().map(Point3::from).collect()).unwrap();
    for cloud in [&line, &plane] {
        for (source, target) in [(cloud, cloud), (cloud, &frame), (&frame, cloud)] {
            let found = align_without_guess(source, target, &CoarseOptions::default());
            assert!(matches!(found, Err(Error::NoAlignment { .. })), "{found:?}");
        }
    }
}

#[test]
fn noise_is_not_aligned() {
    // Points of a ball in the order of an irrational step: no surface anywhere.
    let ball = |phase: f64| {
        let at = |k: f64, step: f64| 2.0 * (k * step + phase).fract() - 1.0;
        let points = (0..6000).map(|k| {
            let k = f64::from(k);
            Point3::new(at(k, 0.754_877_666), at(k, 0.569_840_290), at(k, 0.430_159_709) - 4.0)
        });
        made(points.collect()).unwrap()
    };
    let found = align_without_guess(&ball(0.1), &ball(0.7), &CoarseOptions::default());
    assert!(matches!(found, Err(Error::NoAlignment { .. })), "{found:?}");
}

#[test]
fn duplicate_points_change_nothing() {
    let ([target, source], truth) = frames();
    let twice = |points: &[[f64; 3]]| points.iter().flat_map(|p| [*p, *p]).collect::<Vec<_>>();
    let found = align_points(&twice(&target), &twice(&source), &CoarseOptions::default());
    assert!(matches!(outcome(&truth, found.clone()), Outcome::Right(..)), "{found:?}");
}

#[test]
fn the_unit_of_length_does_not_matter() {
    let ([target, source], truth) = frames();
    for scale in [1e-6, 1e3, 1e6] {
        let scaled = |points: &[[f64; 3]]| points.iter().map(|p| p.map(|c| c * scale)).collect::<Vec<_>>();
        let mut found = align_points(&scaled(&target), &scaled(&source), &CoarseOptions::default()).unwrap();
        found.target_from_source.translation.vector /= scale;
        assert!(matches!(outcome(&truth, Ok(found.clone())), Outcome::Right(..)), "{scale}: {found:?}");
    }
}

#[test]
fn options_outside_their_domain_are_named() {
    let options = CoarseOptions::default();
    let made = |options: &CoarseOptions| FeatureCloud::new(&Cloud::new(vec![Point3::origin()]), options);
    for bad in [
        CoarseOptions { voxel_m: Some(0.0), ..options.clone() },
        CoarseOptions { voxel_m: Some(f64::NAN), ..options.clone() },
        CoarseOptions { tolerance_voxels: -1.0, ..options.clone() },
        CoarseOptions { max_features: 0, ..options.clone() },
        CoarseOptions { min_overlap: f64::INFINITY, ..options.clone() },
        CoarseOptions { min_inside: -0.1, ..options.clone() },
        CoarseOptions { level: f64::NAN, ..options.clone() },
        CoarseOptions { level: 0.0, ..options.clone() },
        CoarseOptions { shared_error: Some(SharedError { sigma_m: -1.0, length_m: 1.0 }), ..options.clone() },
        CoarseOptions { shared_error: Some(SharedError { sigma_m: 1.0, length_m: 0.0 }), ..options.clone() },
    ] {
        assert!(matches!(made(&bad), Err(Error::Input(InputError::InvalidOption { .. }))), "{bad:?}");
    }
    let unseen = CoarseOptions { viewpoint: Viewpoint::At(Point3::new(0.0, f64::NAN, 0.0)), ..options };
    assert!(matches!(made(&unseen), Err(Error::Input(InputError::NonFinite { .. }))));
}
