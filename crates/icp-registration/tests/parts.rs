//! Each part of the family in its place.

use crate::common;
use crate::common::{Pinhole, Scene as Room, cloud, disturbance, look_at, pose_error};
use icp_registration::parts::{
    ClosedForm, Coloured, ErrorMetric, GaussNewton, MaxNormalAngle, NearestPoint, PairRejection, PlaneToPlane,
    PointToPlane, PointToPoint, SymmetricPlanes, TargetRim, Trimmed,
};
use icp_registration::{
    Alternative, DegeneracyPolicy, Error, IcpOptions, IcpTarget, Metric, Registration, RobustKernel, Selection,
};
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};
use point_cloud::Cloud;
use rigid_pose::RotationMethod;

struct Setting {
    target: IcpTarget,
    source: Cloud,
    truth: Isometry3<f64>,
    guess: Isometry3<f64>,
}

fn setting(seed: u64) -> Setting {
    let (a, b) = (look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]), look_at([-1.2, -1.1, 1.3], [1.8, 1.1, 0.85]));
    let (room, camera) = (Room::furnished(), Pinhole { width: 88, height: 72, focal_px: 76.0 });
    let truth = a.inverse() * b;
    Setting {
        target: IcpTarget::new(cloud(&room, &camera, &a, 1.0, 2 * seed)).unwrap(),
        source: cloud(&room, &camera, &b, 1.0, 2 * seed + 1),
        truth,
        guess: disturbance(0.1, 4.0, seed) * truth,
    }
}

/// Runs a registration and holds its pose against the truth.
fn check(name: &str, setting: &Setting, registration: &Registration<'_>, max_mm: f64) -> usize {
    let result = registration.align(&setting.source, &setting.guess).unwrap();
    let (mm, degrees) = pose_error(&result.target_from_source, &setting.truth);
    println!("{name}: {mm:.2} mm {degrees:.4} deg, {} iterations, {:?}", result.iterations, result.stop);
    assert!(mm < max_mm && degrees < max_mm * 0.03, "{name}: {mm} mm {degrees} degrees");
    result.iterations
}

#[test]
fn selections() {
    let s = setting(1);
    let all = [Selection::All, Selection::EveryNth(3), Selection::NormalSpace(2000), Selection::Stability(2000)];
    for selection in all {
        let (name, selection) = (format!("{selection:?}"), Box::new(selection));
        // A quarter of a quarter of a frame's points: 1 to 2 mm.
        check(&name, &s, &Registration { selection, ..Registration::new(NearestPoint::new(&s.target)) }, 6.0);
    }
}

#[test]
fn rejections() {
    let mut s = setting(4);
    let mut target = s.target.cloud().clone();
    target.rim = Some(target.normals.as_ref().unwrap().iter().map(|n| n.x.is_nan()).collect());
    s.target = IcpTarget::new(target).unwrap();
    let all: [(&str, Box<dyn PairRejection>); 3] = [
        ("normal angle", Box::new(MaxNormalAngle(0.5))),
        ("trimmed", Box::new(Trimmed(0.8))),
        ("target rim", Box::new(TargetRim)),
    ];
    for (name, rejection) in all {
        let rejection = vec![rejection];
        check(name, &s, &Registration { rejection, ..Registration::new(NearestPoint::new(&s.target)) }, 5.0);
    }
}

#[test]
fn metrics() {
    let s = setting(5);
    let all: [(&str, Box<dyn ErrorMetric>, f64); 4] = [
        ("point to plane", Box::new(PointToPlane), 4.0),
        ("symmetric", Box::new(SymmetricPlanes), 4.0),
        ("plane to plane", Box::new(PlaneToPlane::default()), 4.0),
        // The pattern of pixels pulls: half the spacing of 50 mm at most.
        ("point to point", Box::new(PointToPoint), 25.0),
    ];
    for (name, metric, max_mm) in all {
        let registration = Registration { metric, ..Registration::new(NearestPoint::new(&s.target)) };
        check(name, &s, &registration, max_mm);
    }
}

#[test]
fn texture_closes_what_a_plane_leaves_open() {
    let grid = |offset: f64| {
        (0..3600).map(move |k| {
            // Unevenness of a millimetre without a pattern.
            let z = 1e-3 * (f64::from(k) * 12.9898 + 1e3 * offset).sin();
            Point3::new(f64::from(k % 60) * 0.02 + offset, f64::from(k / 60) * 0.02 + offset, z)
        })
    };
    let shade = |p: &Point3<f64>| 100.0 * ((7.0 * p.x).sin() + (9.0 * p.y + 2.0 * p.x).cos());
    let painted = |points: Vec<Point3<f64>>| {
        let intensity = Some(points.iter().map(shade).collect());
        let normals = Some(vec![Vector3::z(); points.len()]);
        Cloud { intensity, normals, ..Cloud::new(points) }
    };
    let truth = Isometry3::new(Vector3::new(0.02, -0.015, 0.01), Vector3::new(0.0, 0.0, 0.02));
    let target = IcpTarget::new(painted(grid(0.0).collect())).unwrap();
    let source = painted(grid(0.007).collect()).transformed(&truth.inverse());
    let plain = Registration::new(NearestPoint::new(&target)).align(&source, &Isometry3::identity()).unwrap();
    assert_eq!(plain.degenerate.len(), 3);
    let metric = Box::new(Coloured::new(&source, &target).unwrap());
    let coloured = Registration { metric, ..Registration::new(NearestPoint::new(&target)) };
    let result = coloured.align(&source, &Isometry3::identity()).unwrap();
    let (mm, degrees) = pose_error(&result.target_from_source, &truth);
    println!("coloured: {mm:.3} mm {degrees:.4} deg {:?} {:?}", result.stop, result.degenerate);
    // The intensity is continued linearly over half a spacing of 20 mm: curvature leaves a tenth of that.
    assert!(mm < 1.0 && degrees < 0.1, "{mm} mm {degrees} degrees");
    assert!(result.degenerate.is_empty(), "{:?}", result.degenerate);
}

#[test]
fn minimisers_find_the_same_minimum() {
    let s = setting(6);
    let run = |registration: &Registration<'_>| registration.align(&s.source, &s.guess).unwrap();
    let point = |minimisation| {
        let mut registration = Registration::new(NearestPoint::new(&s.target));
        registration.metric = Box::new(PointToPoint);
        registration.minimisation = minimisation;
        run(&registration)
    };
    let gauss_newton = point(Box::new(GaussNewton));
    for method in [
        RotationMethod::UnitQuaternion,
        RotationMethod::SingularValues,
        RotationMethod::OrthonormalMatrices,
        RotationMethod::DualQuaternions,
    ] {
        let closed = point(Box::new(ClosedForm(method)));
        let (mm, degrees) = pose_error(&gauss_newton.target_from_source, &closed.target_from_source);
        println!("{method:?}: {mm:.4} mm {degrees:.6} deg from Gauss-Newton, {} iterations", closed.iterations);
        // Point to point creeps: the two stop within a few steps of 1e-5 of the radius of each other.
        assert!(mm < 1.0 && degrees < 0.05, "{method:?}");
    }
    let mut wrong = Registration::new(NearestPoint::new(&s.target));
    wrong.minimisation = Box::new(ClosedForm::default());
    assert!(matches!(wrong.align(&s.source, &s.guess), Err(Error::Incompatible { .. })));
}

#[test]
fn what_is_open_takes_the_prior() {
    let wall = |seed| {
        let room = Room { room: common::Cuboid::new([-30.0; 3], [3.0, 30.0, 30.0]), boxes: vec![] };
        let camera = Pinhole { width: 88, height: 72, focal_px: 76.0 };
        let (a, b) = (look_at([0.0; 3], [3.0, 0.2, 0.1]), look_at([0.1, 0.2, -0.1], [3.0, 0.3, 0.3]));
        (cloud(&room, &camera, &a, 1.0, seed), cloud(&room, &camera, &b, 1.0, seed + 1), a.inverse() * b)
    };
    let (target, source, truth) = wall(1);
    let guess = disturbance(0.02, 0.5, 4) * truth;
    let sigma = [0.02, 0.02, 0.02, 0.01, 0.01, 0.01];
    let prior = Matrix6::from_fn(|r, c| if r == c { f64::powi(sigma[r], 2) } else { 0.0 });
    let options = IcpOptions {
        degeneracy: DegeneracyPolicy::HoldAtPrior,
        prior_covariance: Some(prior),
        ..IcpOptions::default()
    };
    let result = icp_registration::align(&source, &target, &guess, &options).unwrap();
    assert_eq!(result.degenerate.len(), 3);
    // Along the wall the guess and its sigma, across it what the points say.
    let normal = result.target_from_source.rotation * source.normals.unwrap()[3000];
    let covariance: nalgebra::Matrix3<f64> = result.covariance.fixed_view::<3, 3>(0, 0).into();
    let along = normal.cross(&Vector3::y()).normalize();
    let kept = (result.target_from_source.translation.vector - guess.translation.vector).dot(&along);
    assert!(kept.abs() < 2e-3, "{kept}");
    let sigma_along = (along.transpose() * covariance * along)[0].sqrt();
    assert!((sigma_along / 0.02 - 1.0).abs() < 0.1, "{sigma_along}");
    assert!((normal.transpose() * covariance * normal)[0].sqrt() < 3e-3);
    let none = IcpOptions { prior_covariance: None, ..options };
    let refused =
        icp_registration::align(&IcpTarget::new(target.clone()).unwrap().cloud().clone(), &target, &guess, &none);
    assert!(matches!(refused, Err(Error::Incompatible { .. })));
}

#[test]
fn the_easy_tier_is_the_same_engine() {
    let s = setting(7);
    for metric in [Metric::PointToPlane, Metric::PointToPoint, Metric::SymmetricPlanes, Metric::PlaneToPlane] {
        let options = IcpOptions { metric, ..IcpOptions::default() };
        let easy = s.target.align(&s.source, &s.guess, &options).unwrap();
        let parts = Registration::with_options(&s.target, &options).align(&s.source, &s.guess).unwrap();
        assert_eq!(easy, parts);
    }
    let alternatives = Alternative::usual(RobustKernel::Huber, None, Some(0.9));
    assert_eq!(alternatives.len(), 1);
}
