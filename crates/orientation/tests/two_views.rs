//! Relative orientation of two views on synthetic targets with truth.

use crate::common::{camera, looking_at, normals, seen};
use nalgebra::{Isometry3, Matrix5, Point3, SMatrix, SVector, Vector3, Vector6};
use orientation::{Error, ImagePoint, RelativeOrientation, RelativeOrientationOptions, orient_two_views};

const SIGMA_PIXEL: f64 = 0.1;

/// Targets in a box of 2 x 1.6 x 1.4 m about the origin, spread by a fixed sequence that depends on `salt`.
fn targets(count: usize, salt: f64) -> Vec<Point3<f64>> {
    let share = |x: f64| (x - x.floor()) * 2.0 - 1.0;
    (0..count)
        .map(|i| {
            let t = i as f64 + 1.0 + salt;
            Point3::new(share(0.754_877 * t), 0.8 * share(0.569_840 * t), 0.7 * share(0.430_160 * t))
        })
        .collect()
}

/// First view from the left, second from the right, 1.2 m apart and 3 m from the targets.
fn stations() -> [Isometry3<f64>; 2] {
    [looking_at([-0.6, 0.2, 3.0], 0.1), looking_at([0.6, -0.1, 2.9], -0.2)]
}

fn truth() -> Isometry3<f64> {
    let [first, second] = stations();
    let mut pose = first.inverse() * second;
    pose.translation.vector.normalize_mut();
    pose
}

fn views(stations: &[Isometry3<f64>; 2], targets: &[Point3<f64>]) -> [Vec<ImagePoint>; 2] {
    stations.map(|station| targets.iter().map(|target| ImagePoint::new(seen(&station, target), SIGMA_PIXEL)).collect())
}

fn disturb(views: &mut [Vec<ImagePoint>; 2], normal: &mut impl FnMut() -> f64) {
    for point in views.iter_mut().flatten() {
        point.pixel = point.pixel.map(|position| position + SIGMA_PIXEL * normal());
    }
}

fn solve(views: &[Vec<ImagePoint>; 2]) -> Result<RelativeOrientation, Error> {
    let camera = camera();
    orient_two_views([&camera; 2], [&views[0], &views[1]], &RelativeOrientationOptions::default())
}

fn error(truth: &Isometry3<f64>, found: &Isometry3<f64>) -> Vector6<f64> {
    rigid_pose::pose_difference(truth, found)
}

#[test]
fn without_noise_pose_and_points_come_back() {
    for count in [7, 8, 30] {
        let all = targets(count, 0.3);
        let found = solve(&views(&stations(), &all)).unwrap();
        assert!(error(&truth(), &found.first_from_second).norm() < 1e-8, "{count}");
        assert!(found.gross_errors.is_empty());
        assert_eq!(found.redundancy, count as i64 - 5);
        let [first, second] = stations();
        let base = (first.inverse() * second).translation.vector.norm();
        for (point, target) in found.points.iter().zip(&all) {
            let expected = first.inverse_transform_point(target).coords / base;
            assert!((point.unwrap().point.coords - expected).norm() < 1e-7);
        }
    }
}

/// Mean normalised square of pose errors (five) and point errors (three), and of `vᵀPv` over the redundancy.
fn repeated(count: usize, wrong: usize, runs: u64) -> [f64; 4] {
    let (all, truth) = (targets(count, 0.7), truth());
    let [first, second] = stations();
    let base = (first.inverse() * second).translation.vector.norm();
    let (mut pose, mut points, mut unit, mut missed, mut found_points) = (0.0, 0.0, 0.0, 0, 0);
    let mut ambiguous = 0;
    for run in 0..runs {
        let mut normal = normals(1_000 + run);
        let mut views = views(&stations(), &all);
        disturb(&mut views, &mut normal);
        for i in 0..wrong {
            // Across the epipolar lines, 3 to 20 pixels either way.
            let size = 3.0 + 17.0 * (0.37 * (run + 3 * i as u64) as f64).fract();
            views[1][7 * i % count].pixel[1] += size.copysign(normal());
        }
        let found = match solve(&views) {
            Err(Error::Ambiguous { .. }) => {
                ambiguous += 1;
                continue;
            }
            other => other.unwrap(),
        };
        missed += (0..wrong).filter(|i| !found.gross_errors.contains(&(7 * i % count))).count();
        let (basis, covariance): (SMatrix<f64, 6, 5>, Matrix5<f64>) = found.five_parameters();
        let error: SVector<f64, 5> = basis.transpose() * error(&truth, &found.first_from_second);
        pose += error.dot(&(covariance.try_inverse().unwrap() * error));
        unit += found.sigma0.map_or(1.0, |sigma0| sigma0 * sigma0);
        for (point, target) in found.points.iter().zip(&all) {
            let Some(point) = point else { continue };
            let gap = point.point.coords - first.inverse_transform_point(target).coords / base;
            points += gap.dot(&(point.covariance.try_inverse().unwrap() * gap));
            found_points += 1;
        }
    }
    assert!(ambiguous * 10 < runs, "{ambiguous}");
    let runs = (runs - ambiguous) as f64;
    [pose / runs, points / f64::from(found_points), unit / runs, missed as f64]
}

#[test]
fn the_covariance_is_that_of_repeated_orientations() {
    require_true_covariances(50);
}

#[test]
#[ignore = "long: cargo xtask verify tests"]
fn the_covariance_is_that_of_two_hundred_orientations() {
    require_true_covariances(200);
}

/// Chi-squared of five has mean 5 and variance 10: over 200 runs it scatters by 0.22, over 50 by 0.45; 10 % are 0.5. The first of the
/// runs are the same, and held to the same bounds.
fn require_true_covariances(runs: u64) {
    for (count, wrong) in [(20, 0), (12, 0), (25, 5)] {
        let [pose, points, unit, missed] = repeated(count, wrong, runs);
        eprintln!("{count} {wrong}: pose {pose}, points {points}, variance {unit}, missed {missed}");
        assert!((pose - 5.0).abs() < 0.5, "{count} {wrong}: pose {pose}");
        assert!((points - 3.0).abs() < 0.3, "{count} {wrong}: points {points}");
        assert!((unit - 1.0).abs() < 0.1, "{count} {wrong}: variance {unit}");
        assert!(missed < 1.0, "{count} {wrong}: gross errors missed {missed}");
    }
}

#[test]
fn the_minimum_does_not_depend_on_the_start() {
    let mut views = views(&stations(), &targets(25, 0.1));
    disturb(&mut views, &mut normals(3));
    let camera = camera();
    let with = |seed| {
        let options = RelativeOrientationOptions { seed, ..RelativeOrientationOptions::default() };
        orient_two_views([&camera; 2], [&views[0], &views[1]], &options).unwrap()
    };
    let first = with(0);
    for seed in 1..6 {
        assert!(error(&first.first_from_second, &with(seed).first_from_second).norm() < 1e-9);
    }
    // The other way around it is the inverse.
    let back = orient_two_views([&camera; 2], [&views[1], &views[0]], &RelativeOrientationOptions::default()).unwrap();
    assert!(
        error(&first.first_from_second, &{
            let mut inverse = back.first_from_second.inverse();
            inverse.translation.vector.normalize_mut();
            inverse
        })
        .norm()
            < 1e-6
    );
}

#[test]
fn a_flat_field_has_two_solutions() {
    let flat: Vec<_> = targets(20, 0.2).iter().map(|p| Point3::new(p.x, p.y, 0.0)).collect();
    // Towards the wall: base and normal of the plane can change places, and all targets stay in front of both cameras.
    let towards = [looking_at([0.0, 0.0, 4.0], 0.1), looking_at([0.6, 0.3, 2.8], -0.2)];
    let mut truth = towards[0].inverse() * towards[1];
    truth.translation.vector.normalize_mut();
    let mut both = views(&towards, &flat);
    disturb(&mut both, &mut normals(5));
    let answer = solve(&both);
    let Err(Error::Ambiguous { poses, difference }) = answer else { panic!("{answer:?}") };
    assert_eq!(poses.len(), 2);
    assert!(difference < 10.83);
    assert!(poses.iter().any(|pose| error(&truth, pose).norm() < 0.1), "{poses:?}");
    assert!(error(&poses[0], &poses[1]).norm() > 0.1);
    // A target well off the plane decides.
    let mut deep = flat.clone();
    deep.extend([Point3::new(0.1, 0.2, 0.9), Point3::new(-0.4, 0.1, 0.8), Point3::new(0.5, -0.3, -1.0)]);
    let mut decided = views(&towards, &deep);
    disturb(&mut decided, &mut normals(6));
    assert!(error(&truth, &solve(&decided).unwrap().first_from_second).norm() < 0.05);
}

#[test]
fn a_rotation_alone_is_named() {
    let [first, _] = stations();
    let turned = first * Isometry3::rotation(Vector3::new(0.05, 0.1, 0.2));
    for seed in 0..20 {
        let mut both = views(&[first, turned], &targets(20, 0.5));
        disturb(&mut both, &mut normals(seed));
        let answer = solve(&both);
        assert!(matches!(answer, Err(Error::NoBase { .. })), "{answer:?}");
    }
    // Five millimetres at three metres: 0.3 pixel of parallax, whose direction is hardly known.
    let near = Isometry3::translation(5e-3, 0.0, 0.0) * turned;
    let mut both = views(&[first, near], &targets(20, 0.5));
    disturb(&mut both, &mut normals(1));
    let answer = solve(&both);
    assert!(
        matches!(answer, Err(Error::NoBase { .. } | Error::WeakBase { .. } | Error::Ambiguous { .. })),
        "{answer:?}"
    );
}

#[test]
fn five_pairs_leave_several_poses_and_fewer_are_refused() {
    let both = views(&stations(), &targets(5, 0.9));
    match solve(&both) {
        Err(Error::Ambiguous { poses, .. }) => {
            assert!(poses.iter().any(|pose| error(&truth(), pose).norm() < 1e-6), "{poses:?}");
        }
        Ok(found) => assert!(error(&truth(), &found.first_from_second).norm() < 1e-6),
        other => panic!("{other:?}"),
    }
    for count in 0..5 {
        let both = both.clone().map(|view| view[..count].to_vec());
        assert_eq!(solve(&both), Err(Error::TooFewTargets { found: count, needed: 5 }));
    }
}

#[test]
fn what_cannot_be_right_is_refused_by_name() {
    let good = views(&stations(), &targets(12, 0.4));
    let mut short = good.clone();
    short[1].pop();
    assert_eq!(solve(&short), Err(Error::LengthMismatch { first: 12, second: 11 }));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut broken = good.clone();
        broken[0][3].pixel[1] = bad;
        assert!(matches!(solve(&broken), Err(Error::InvalidTarget { target: 3, name: "row", .. })));
    }
    for bad in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
        let mut broken = good.clone();
        broken[1][4].sigma_pixel[0] = bad;
        assert!(matches!(solve(&broken), Err(Error::InvalidTarget { target: 4, name: "sigma_col", .. })));
    }
    // All image points in one place, one view twice, and targets shuffled.
    let same = good.clone().map(|view| vec![view[0]; 12]);
    assert!(solve(&same).is_err());
    assert!(matches!(solve(&[good[0].clone(), good[0].clone()]), Err(Error::NoBase { .. })));
    let mut shuffled = views(&stations(), &targets(30, 0.4));
    shuffled[1] = (0..30).map(|i| shuffled[1][7 * i % 30]).collect();
    let answer = solve(&shuffled);
    assert!(matches!(answer, Err(Error::NoAgreement { .. })), "{answer:?}");
    let mut wild = good;
    wild[0][0].pixel = [1e200, -1e200];
    let _ = solve(&wild);
}
