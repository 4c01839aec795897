//! Resection on synthetic stations with truth.

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, UnitQuaternion, Vector3, Vector6};
use orientation::{Error, Resection, ResectionOptions, Start, TargetObservation, resect};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

const SIGMA_PIXEL: f64 = 0.1;
const SIGMA_RANGE: f64 = 0.005;

fn camera() -> Camera {
    Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(),
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, p1: 1.2e-4, ..LensDistortion::default() },
    )
    .unwrap()
}

/// Seven targets within 0.8 m of the origin, not in one plane.
fn room() -> Vec<Point3<f64>> {
    [
        [-0.7, -0.5, 0.1],
        [0.7, -0.5, -0.2],
        [0.6, 0.5, 0.3],
        [-0.6, 0.5, -0.1],
        [0.1, 0.0, 0.6],
        [-0.2, 0.1, -0.5],
        [0.0, -0.3, 0.2],
    ]
    .map(Point3::from)
    .to_vec()
}

/// A camera at a distance of the origin, looking at it from anywhere, rolled.
fn looking_at_origin(direction: Vector3<f64>, distance: f64, roll: f64) -> Isometry3<f64> {
    let eye = Point3::from(direction.normalize() * distance);
    let up = if direction.x.abs() < direction.y.abs() { Vector3::x() } else { Vector3::y() };
    let rotation = UnitQuaternion::face_towards(&eye.coords, &up);
    Isometry3::from_parts(eye.coords.into(), rotation * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll))
}

fn observed(camera: &Camera, pose: &Isometry3<f64>, point: Point3<f64>) -> TargetObservation {
    let seen = camera.observe(pose, &point).unwrap();
    TargetObservation::new(point, camera.format.pixel_from_image(seen.image_mm), SIGMA_PIXEL)
        .with_range(seen.range_m, SIGMA_RANGE)
}

fn station(pose: &Isometry3<f64>, points: &[Point3<f64>]) -> Vec<TargetObservation> {
    points.iter().map(|point| observed(&camera(), pose, *point)).collect()
}

fn without_ranges(targets: &[TargetObservation]) -> Vec<TargetObservation> {
    targets.iter().map(|target| TargetObservation { range: None, ..*target }).collect()
}

fn solve(targets: &[TargetObservation]) -> Result<Resection, Error> {
    resect(&camera(), targets, &ResectionOptions::default())
}

/// `[dt, dtheta]` from the true to the found pose.
fn error(truth: &Isometry3<f64>, found: &Isometry3<f64>) -> Vector6<f64> {
    let dt = found.translation.vector - truth.translation.vector;
    let turn = (truth.rotation.inverse() * found.rotation).scaled_axis();
    Vector6::new(dt.x, dt.y, dt.z, turn.x, turn.y, turn.z)
}

fn direction() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-1.0..1.0_f64).prop_map(Vector3::from).prop_filter("not zero", |v| v.norm() > 0.1)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn the_true_pose_comes_back(direction in direction(), distance in 2.5..4.0_f64, roll in -3.0..3.0_f64) {
        let truth = looking_at_origin(direction, distance, roll);
        let targets = station(&truth, &room());
        for targets in [targets.clone(), without_ranges(&targets)] {
            let found = solve(&targets).unwrap();
            // The adjustment ends at 1e-8 standard deviations (millimetres); the rest is rounding.
            prop_assert!(error(&truth, &found.world_from_camera).norm() < 1e-9);
            prop_assert!(found.sigma0.unwrap() < 1e-6);
        }
    }

    #[test]
    fn nothing_panics(numbers in prop::array::uniform12(any::<f64>()), ordinary in prop::array::uniform12(-10.0..200.0_f64)) {
        for set in [numbers, ordinary] {
            let targets: Vec<_> = set.chunks_exact(4).enumerate()
                .map(|(i, n)| TargetObservation::new(Point3::new(n[0], n[1], i as f64), [n[2], n[3]], SIGMA_PIXEL))
                .collect();
            let _ = solve(&targets);
        }
    }
}

#[test]
fn three_targets_with_ranges_suffice() {
    let truth = looking_at_origin(Vector3::new(0.3, 0.4, 1.0), 3.0, 0.2);
    let targets = station(&truth, &room()[..3]);
    let found = solve(&targets).unwrap();
    assert!(error(&truth, &found.world_from_camera).norm() < 1e-9);
    assert_eq!(found.redundancy, 3);
    assert_eq!(found.start, Start::Ranges);
}

#[test]
fn three_image_points_are_ambiguous_and_an_approximation_decides() {
    let truth = looking_at_origin(Vector3::new(0.3, 0.4, 1.0), 3.0, 0.2);
    let targets = without_ranges(&station(&truth, &room()[..3]));
    let Err(Error::Ambiguous { poses, difference }) = solve(&targets) else {
        panic!("one of several solutions was chosen")
    };
    assert!(poses.len() > 1 && difference.abs() < 1e-6);
    // The truth is among them.
    let nearest = poses.iter().map(|pose| error(&truth, pose).norm()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-6, "{nearest}");
    let approximate = Some(camera_model::step_pose(&truth, &[0.05, -0.05, 0.05, 0.02, 0.02, -0.02]));
    let options = ResectionOptions { approximate, ..ResectionOptions::default() };
    let found = resect(&camera(), &targets, &options).unwrap();
    assert!(error(&truth, &found.world_from_camera).norm() < 1e-6);
    assert_eq!((found.start, found.redundancy, found.sigma0), (Start::Given, 0, None));
    assert!(found.residuals[0].standardised.is_nan());
}

#[test]
fn one_range_decides_between_the_poses_of_three_image_points() {
    let truth = looking_at_origin(Vector3::new(0.3, 0.4, 1.0), 3.0, 0.2);
    let mut targets = without_ranges(&station(&truth, &room()[..3]));
    let Err(Error::Ambiguous { poses, .. }) = solve(&targets) else { panic!("not ambiguous") };
    let distance = |pose: &Isometry3<f64>, i: usize| (pose.translation.vector - targets[i].point.coords).norm();
    // How far the nearest rival of the truth is apart in the range to each target: only there can a range decide.
    let apart = |i: usize| {
        let differences = poses.iter().filter(|pose| error(&truth, pose).norm() > 1e-3);
        differences.map(|pose| (distance(pose, i) - distance(&truth, i)).abs()).fold(f64::INFINITY, f64::min)
    };
    let decisive = (0..3).max_by(|&a, &b| apart(a).total_cmp(&apart(b))).unwrap();
    assert!(apart(decisive) > 5.0 * SIGMA_RANGE, "{}", apart(decisive));
    targets[decisive] = targets[decisive].with_range(distance(&truth, decisive), SIGMA_RANGE);
    let found = solve(&targets).unwrap();
    assert!(error(&truth, &found.world_from_camera).norm() < 1e-6);
    assert_eq!(found.start, Start::ImagePoints);
}

#[test]
fn mirror_poses_of_a_small_flat_group() {
    // Four corners of a 10 cm plate at 4 m, seen obliquely from the front: perspective is 0.1 pixel, so the plate may
    // as well be tilted the other way. With ranges of 5 mm that is still open, a larger plate settles it.
    let plate =
        |half: f64| [[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]].map(Point3::from);
    let truth = looking_at_origin(Vector3::new(0.3, 0.0, 1.0), 4.0, 0.0);
    let small = without_ranges(&station(&truth, &plate(0.05)));
    let Err(Error::Ambiguous { poses, .. }) = solve(&small) else { panic!("the mirror pose was not seen") };
    assert_eq!(poses.len(), 2);
    let large = without_ranges(&station(&truth, &plate(0.7)));
    assert!(error(&truth, &solve(&large).unwrap().world_from_camera).norm() < 1e-6);
}

/// Mean normalised square of the error over repeated noisy resections, and the mean sigma0.
fn repeated(truth: &Isometry3<f64>, control: Option<Matrix3<f64>>, with_ranges: bool, runs: usize) -> (f64, f64) {
    let mut generator = Pcg64::seed_from_u64(7);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut generator) };
    let lower = control.map(|covariance| covariance.cholesky().unwrap().l());
    let (mut squares, mut sigma0) = (0.0, 0.0);
    for _ in 0..runs {
        let targets: Vec<_> = room()
            .into_iter()
            .map(|point| {
                let mut target = observed(&camera(), truth, point);
                target.pixel = target.pixel.map(|position| position + SIGMA_PIXEL * normal());
                let range = target.range.unwrap().range_m + SIGMA_RANGE * normal();
                target = if with_ranges {
                    target.with_range(range, SIGMA_RANGE)
                } else {
                    TargetObservation { range: None, ..target }
                };
                if let (Some(lower), Some(covariance)) = (lower, control) {
                    target.point += lower * Vector3::new(normal(), normal(), normal());
                    target = target.with_point_covariance(covariance);
                }
                target
            })
            .collect();
        let found = solve(&targets).unwrap();
        let error = error(truth, &found.world_from_camera);
        squares += error.dot(&(found.covariance.try_inverse().unwrap() * error));
        sigma0 += found.sigma0.unwrap();
    }
    (squares / runs as f64, sigma0 / runs as f64)
}

/// The normalised square of a six-dimensional error is chi-squared with mean 6 and variance 12: over 400 runs the mean
/// scatters by 0.17, and 0.7 is four times that. A unit standard deviation scatters by 1/sqrt(2 r n), below 0.02.
#[test]
fn the_covariance_is_that_of_repeated_resections() {
    let truth = looking_at_origin(Vector3::new(-0.5, 0.4, 1.0), 3.0, 0.3);
    let control = Matrix3::new(4e-6, 1e-6, 0.0, 1e-6, 9e-6, 0.0, 0.0, 0.0, 2.5e-5);
    for (control, with_ranges) in [(None, true), (None, false), (Some(control), true)] {
        let (square, sigma0) = repeated(&truth, control, with_ranges, 400);
        assert!((square - 6.0).abs() < 0.7, "normalised square {square}, control {control:?}, ranges {with_ranges}");
        // The mean of sigma0 lies below 1 by a quarter of 1/redundancy, at most 0.04.
        assert!((sigma0 - 1.0).abs() < 0.07, "sigma0 {sigma0}");
    }
}

/// Four targets at random on a plate of 1.3 m, image points only: many such stations are weak. Where the curvature is at
/// most 0.5, the normalised square must still average to 6 (it scatters by sqrt(12 / n), 0.2 here; 0.8 is four times).
#[test]
fn the_curvature_tells_when_to_believe_the_covariance() {
    let mut generator = Pcg64::seed_from_u64(3);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut generator) };
    let (mut squares, mut believed, mut refused) = (0.0, 0, 0);
    for _ in 0..400 {
        let truth = looking_at_origin(Vector3::new(normal(), normal(), normal().abs() + 0.5), 3.0, normal());
        let points: Vec<_> =
            (0..4).map(|_| 0.5 * Point3::new(normal().clamp(-1.3, 1.3), normal().clamp(-1.3, 1.3), 0.0)).collect();
        let mut targets = without_ranges(&station(&truth, &points));
        for target in &mut targets {
            target.pixel = target.pixel.map(|position| position + SIGMA_PIXEL * normal());
        }
        match solve(&targets) {
            Ok(found) if found.curvature <= 0.5 => {
                let error = error(&truth, &found.world_from_camera);
                squares += error.dot(&(found.covariance.try_inverse().unwrap() * error));
                believed += 1;
            }
            Ok(_) => {}
            Err(_) => refused += 1,
        }
    }
    let square = squares / f64::from(believed);
    assert!(believed > 250 && refused > 20, "{believed} {refused}");
    assert!((square - 6.0).abs() < 0.8, "normalised square {square} over {believed}");
}

#[test]
fn ranges_and_control_matter() {
    let truth = looking_at_origin(Vector3::new(-0.5, 0.4, 1.0), 3.0, 0.3);
    let targets = station(&truth, &room());
    let trace = |covariance: &Matrix6<f64>| covariance.fixed_view::<3, 3>(0, 0).trace();
    let with = solve(&targets).unwrap();
    let without = solve(&without_ranges(&targets)).unwrap();
    let noisy: Vec<_> = targets.iter().map(|t| t.with_point_covariance(Matrix3::identity() * 1e-4)).collect();
    let control = solve(&noisy).unwrap();
    assert!(trace(&with.covariance) < trace(&without.covariance));
    assert!(trace(&with.covariance) < trace(&control.covariance));
}

#[test]
fn a_mistaken_target_shows() {
    let truth = looking_at_origin(Vector3::new(0.2, -0.6, 1.0), 3.0, -0.4);
    let mut targets = without_ranges(&station(&truth, &room()));
    targets[4].pixel[0] += 4.0;
    let found = solve(&targets).unwrap();
    assert!(found.sigma0.unwrap() > 3.0);
    let worst =
        (0..targets.len()).max_by(|&a, &b| found.residuals[a].standardised.total_cmp(&found.residuals[b].standardised));
    assert_eq!(worst, Some(4));
    // v = observed - model: the residual has the sign of the error.
    assert!(found.residuals[4].pixel[0] > 1.0 && found.residuals[4].standardised > 3.3);
    targets.remove(4);
    assert!(error(&truth, &solve(&targets).unwrap().world_from_camera).norm() < 1e-9);
}

#[test]
fn too_few_and_collinear_targets_are_refused() {
    let truth = looking_at_origin(Vector3::new(0.0, 0.3, 1.0), 3.0, 0.0);
    let targets = station(&truth, &room());
    for count in 0..3 {
        assert_eq!(solve(&targets[..count]), Err(Error::TooFewTargets { found: count, needed: 3 }));
    }
    let line: Vec<_> =
        (0..6).map(|i| Point3::new(-0.5 + 0.2 * f64::from(i), 0.1 * f64::from(i), 0.05 * f64::from(i))).collect();
    assert!(matches!(solve(&station(&truth, &line)), Err(Error::CollinearTargets { .. })));
    let same = [Point3::new(0.1, 0.1, 0.1); 4];
    assert!(matches!(solve(&station(&truth, &same)), Err(Error::CollinearTargets { .. })));
    // Half a millimetre off the line is 0.03 pixel, less than the noise: no turn about the line can be told.
    let mut almost = line.clone();
    almost[2].y += 5e-4;
    let answer = solve(&station(&truth, &almost));
    assert!(matches!(answer, Err(Error::WeakGeometry { .. } | Error::Ambiguous { .. })), "{answer:?}");
}

#[test]
fn bad_numbers_are_refused_by_name() {
    type Change = fn(&mut TargetObservation);
    let truth = looking_at_origin(Vector3::new(0.0, 0.3, 1.0), 3.0, 0.0);
    let good = station(&truth, &room());
    let with = |change: Change| {
        let mut targets = good.clone();
        change(&mut targets[2]);
        solve(&targets)
    };
    let changes: [(&str, Change); 6] = [
        ("x", |target| target.point.x = f64::NAN),
        ("row", |target| target.pixel[1] = f64::INFINITY),
        ("sigma_col", |target| target.sigma_pixel[0] = 0.0),
        ("sigma_row", |target| target.sigma_pixel[1] = f64::NAN),
        ("range", |target| *target = target.with_range(-1.0, 0.01)),
        ("sigma_range", |target| *target = target.with_range(1.0, -0.01)),
    ];
    for (expected, change) in changes {
        let Err(Error::InvalidTarget { target: 2, name, .. }) = with(change) else { panic!("{expected} was accepted") };
        assert_eq!(name, expected);
    }
    assert!(matches!(with(|t| t.point_covariance = Some(-Matrix3::identity())), Err(Error::Adjustment(_))));
    let mut broken = camera();
    broken.interior.principal_distance_mm = -1.0;
    assert!(matches!(resect(&broken, &good, &ResectionOptions::default()), Err(Error::Camera(_))));
}
