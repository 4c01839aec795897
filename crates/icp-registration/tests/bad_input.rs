//! Input that has no answer gets a typed one.

use crate::common::{Pinhole, Scene, cloud, look_at};
use icp_registration::{Error, IcpOptions, IcpTarget, Metric, RobustKernel, Selection, align};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use point_cloud::Error as CloudError;
use rigid_pose::InputError;

fn good() -> Cloud {
    cloud(&Scene::furnished(), &Pinhole { width: 44, height: 36, focal_px: 38.0 }, &pose(), 1.0, 1)
}

fn pose() -> Isometry3<f64> {
    look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8])
}

fn all_metrics() -> [IcpOptions; 4] {
    [Metric::PointToPlane, Metric::PointToPoint, Metric::SymmetricPlanes, Metric::PlaneToPlane]
        .map(|metric| IcpOptions { metric, ..IcpOptions::default() })
}

#[test]
fn points_that_are_there_twice_do_not_matter() {
    let twice = |c: &Cloud| {
        let both = |n: &Vec<Vector3<f64>>| n.iter().chain(n).copied().collect();
        let points = c.points.iter().chain(&c.points).copied().collect();
        Cloud { normals: c.normals.as_ref().map(both), ..Cloud::new(points) }
    };
    let guess = Isometry3::new(Vector3::new(0.02, 0.01, -0.02), Vector3::new(0.01, 0.0, 0.01));
    for options in all_metrics() {
        let result = align(&twice(&good()), &twice(&good()), &guess, &options).unwrap();
        let error = result.target_from_source;
        // A cloud against itself has an exact answer; the step tolerance is 1e-5 of a radius of 1 m, and points slide
        // past each other by a part of their distance of 5 cm before they settle.
        assert!(
            error.translation.vector.norm() < 5e-3 && error.rotation.angle() < 5e-3,
            "{:?} {error}",
            options.metric
        );
    }
}

#[test]
fn clouds_that_cannot_be_aligned() {
    let id = Isometry3::identity();
    let good = good();
    for options in all_metrics() {
        let run = |source: &Cloud, target: &Cloud| align(source, target, &id, &options);
        assert!(matches!(
            run(&Cloud::default(), &good),
            Err(Error::Cloud(CloudError::Input(InputError::Empty { what: "the source cloud" })))
        ));
        assert!(matches!(
            run(&good, &Cloud::default()),
            Err(Error::Cloud(CloudError::Input(InputError::Empty { what: "the target cloud" })))
        ));
        let nan = Cloud::new(vec![Point3::new(f64::NAN, 0.0, 0.0); 30]);
        assert!(matches!(
            run(&nan, &good),
            Err(Error::Cloud(CloudError::Input(InputError::NonFinite { index: 0, .. })))
        ));
        assert!(matches!(
            run(&good, &nan),
            Err(Error::Cloud(CloudError::Input(InputError::NonFinite { index: 0, .. })))
        ));
        let one = Cloud::new(vec![Point3::new(0.0, 0.0, -1.0)]);
        assert!(matches!(run(&one, &good), Err(Error::Input(InputError::TooFewCorrespondences { .. }))));
        assert!(
            matches!(run(&good, &one), Err(Error::Input(InputError::TooFewCorrespondences { .. })))
                || options.metric == Metric::PointToPoint
        );
        let far = good.transformed(&Isometry3::translation(0.0, 1e6, 0.0));
        assert!(matches!(run(&far, &good), Err(Error::Input(InputError::TooFewCorrespondences { .. }))));
    }
}

#[test]
fn lines_and_equal_points_are_told_from_a_pose() {
    let id = Isometry3::identity();
    let line = Cloud::new((0..200).map(|i| Point3::new(f64::from(i) * 0.01, 0.0, -1.0)).collect());
    let equal = Cloud::new(vec![Point3::new(0.0, 0.0, -1.0); 200]);
    for options in all_metrics() {
        for cloud in [&line, &equal] {
            match align(cloud, cloud, &id, &options) {
                Ok(result) => assert!(!result.degenerate.is_empty() && !result.is_trustworthy()),
                Err(error) => {
                    assert!(matches!(error, Error::Input(InputError::TooFewCorrespondences { .. })), "{error}");
                }
            }
        }
    }
}

#[test]
fn planes_of_another_length_and_bad_sigmas() {
    let (id, options) = (Isometry3::identity(), IcpOptions::default());
    let good = good();
    let short = Cloud { normals: Some(vec![Vector3::z(); 3]), ..good.clone() };
    assert!(matches!(
        align(&short, &good, &id, &options),
        Err(Error::Cloud(CloudError::Input(InputError::LengthMismatch { what: "normals", .. })))
    ));
    let short = Cloud { sigma: Some(vec![1.0; 3]), ..good.clone() };
    assert!(matches!(
        align(&good, &short, &id, &options),
        Err(Error::Cloud(CloudError::Input(InputError::LengthMismatch { what: "sigma", .. })))
    ));
    let mut sigma = vec![1e-3; good.len()];
    sigma[4] = 0.0;
    let zero = Cloud { sigma: Some(sigma), ..good.clone() };
    assert!(matches!(
        align(&zero, &good, &id, &options),
        Err(Error::Cloud(CloudError::Input(InputError::NotPositive { what: "sigma", index: 4, .. })))
    ));
    let unknown = Cloud { sigma: Some(vec![f64::NAN; good.len()]), ..good.clone() };
    assert!(align(&unknown, &good, &id, &options).unwrap().rms_m.is_finite());
    assert!(matches!(
        Cloud::from_frame(&[[0.0; 3]; 2], None, Some(&[1.0])),
        Err(point_cloud::Error::Input(InputError::LengthMismatch { .. }))
    ));
}

#[test]
fn options_and_guesses_outside_their_domain() {
    let good = good();
    let id = Isometry3::identity();
    let default = IcpOptions::default;
    for options in [
        IcpOptions { trim: 0.0, ..default() },
        IcpOptions { trim: f64::NAN, ..default() },
        IcpOptions { max_iterations: 0, ..default() },
        IcpOptions { max_correspondence_distance_m: Some(-1.0), ..default() },
        IcpOptions { initial_correspondence_distance_m: Some(f64::NAN), ..default() },
        IcpOptions { selection: Selection::EveryNth(0), ..default() },
        IcpOptions { selection: Selection::NormalSpace(0), ..default() },
    ] {
        assert!(
            matches!(align(&good, &good, &id, &options), Err(Error::Input(InputError::InvalidOption { .. }))),
            "{options:?}"
        );
    }
    let nan = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert!(matches!(
        align(&good, &good, &nan, &default()),
        Err(Error::Input(InputError::NonFinite { what: "the guess", .. }))
    ));
}

#[test]
fn a_cloud_on_itself_and_at_a_scale_of_a_million() {
    let target = good();
    let guess = Isometry3::new(Vector3::new(0.02, 0.01, -0.02), Vector3::new(0.01, 0.0, 0.01));
    for kernel in [
        RobustKernel::None,
        RobustKernel::Huber,
        RobustKernel::Tukey,
        RobustKernel::Cauchy,
        RobustKernel::GemanMcClure,
        RobustKernel::Welsch,
    ] {
        for scale in [1e-6, 1.0, 1e6] {
            let scaled =
                |c: &Cloud| Cloud { points: c.points.iter().map(|p| p * scale).collect(), sigma: None, ..c.clone() };
            let start = Isometry3::from_parts((guess.translation.vector * scale).into(), guess.rotation);
            let options = IcpOptions { kernel, ..IcpOptions::default() };
            let result = align(&scaled(&target), &scaled(&target), &start, &options).unwrap();
            let error = result.target_from_source.translation.vector.norm() / scale;
            // A cloud against itself has an exact answer; the step tolerance is 1e-5 of a radius of 1 m.
            assert!(error < 1e-5 && result.target_from_source.rotation.angle() < 1e-5, "{kernel:?} {scale}: {error}");
            assert!(result.degenerate.is_empty(), "{kernel:?} {scale}: {:?}", result.degenerate);
        }
    }
}

#[test]
fn a_prepared_target_gives_what_align_gives() {
    let target = good();
    let source = cloud(&Scene::furnished(), &Pinhole { width: 44, height: 36, focal_px: 38.0 }, &pose(), 1.0, 2);
    let options = IcpOptions::default();
    let prepared = IcpTarget::new(target.clone()).unwrap();
    let a = prepared.align(&source, &Isometry3::identity(), &options).unwrap();
    let b = align(&source, &target, &Isometry3::identity(), &options).unwrap();
    assert_eq!(a, b);
    assert_eq!((prepared.cloud().len(), prepared.normals().len()), (target.len(), target.len()));
    assert!(prepared.spacing_m() > 0.0);
}
