//! Closed-form absolute orientation.

use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::{InputError, absolute_orientation, absolute_orientation_with_scale, pose_difference};

fn random_points(n: usize, spread: f64, random: &mut Pcg64) -> Vec<Point3<f64>> {
    (0..n).map(|_| Point3::from(Vector3::from_fn(|_, _| spread * normal(random)))).collect()
}

fn normal(random: &mut Pcg64) -> f64 {
    StandardNormal.sample(random)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn exact_pairs_give_the_pose_back(
        seed in 0u64..1000, n in 3usize..30, shift in prop::array::uniform3(-100.0..100.0_f64),
        turn in prop::array::uniform3(-1.8..1.8_f64), scale in 0.1..10.0_f64,
    ) {
        let source = random_points(n, 1.0, &mut Pcg64::seed_from_u64(seed));
        let pose = Isometry3::new(Vector3::from(shift), Vector3::from(turn));
        let target: Vec<_> = source.iter().map(|p| pose * p).collect();
        let found = absolute_orientation(&source, &target, None).unwrap();
        // Rounding of coordinates of 100 m, magnified where three points happen to lie near one line.
        prop_assert!(pose_difference(&found.target_from_source, &pose).norm() < 1e-9);
        let scaled: Vec<_> = source.iter().map(|p| pose * (p * scale)).collect();
        let similar = absolute_orientation_with_scale(&source, &scaled, None).unwrap();
        prop_assert!((similar.scale / scale - 1.0).abs() < 1e-9);
        prop_assert!(pose_difference(&similar.orientation.target_from_source, &pose).norm() < 1e-8);
    }
}

#[test]
fn a_plane_of_points_and_half_a_turn_are_no_trouble() {
    let source = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.0, 3.0]].map(|p| Point3::new(p[0], p[1], 0.0));
    let half_turn = UnitQuaternion::from_scaled_axis(Vector3::new(1.0, 1.0, 0.0).normalize() * std::f64::consts::PI);
    let pose = Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), half_turn);
    let target: Vec<_> = source.iter().map(|p| pose * p).collect();
    let found = absolute_orientation(&source, &target, None).unwrap().target_from_source;
    assert!((found.translation.vector - pose.translation.vector).norm() < 1e-12);
    assert!(found.rotation.angle_to(&pose.rotation) < 1e-7);
}

#[test]
fn covariance_is_that_of_repeated_trials() {
    let mut random = Pcg64::seed_from_u64(5);
    let source = random_points(12, 1.5, &mut random);
    let pose = Isometry3::new(Vector3::new(0.3, -1.0, 2.0), Vector3::new(0.5, -0.2, 1.0));
    let weights: Vec<f64> = (0..12).map(|i| 1.0 / f64::from(1 + i % 4).powi(2)).collect();
    let trials = 3000;
    let mut sampled = Matrix6::zeros();
    let mut predicted = Matrix6::zeros();
    let mut normalised = 0.0;
    for _ in 0..trials {
        let target: Vec<_> = source
            .iter()
            .zip(&weights)
            .map(|(p, w)| pose * p + Vector3::from_fn(|_, _| 2e-3 / w.sqrt() * normal(&mut random)))
            .collect();
        let found = absolute_orientation(&source, &target, Some(&weights)).unwrap();
        let d = pose_difference(&pose, &found.target_from_source);
        sampled += d * d.transpose() / f64::from(trials);
        predicted += found.covariance / f64::from(trials);
        normalised += d.dot(&((found.cofactor * 4e-6).try_inverse().unwrap() * d)) / f64::from(trials);
    }
    // Chi-squared with 6 degrees of freedom, its mean over 3000 trials: 6 +- 0.06.
    assert!((normalised - 6.0).abs() < 0.25, "{normalised}");
    for k in 0..6 {
        // Variance of 3000 samples: 2.6 %.
        assert!((sampled[(k, k)] / predicted[(k, k)] - 1.0).abs() < 0.1, "{k}");
    }
}

#[test]
fn standard_deviation_of_the_scale_is_that_of_repeated_trials() {
    let mut random = Pcg64::seed_from_u64(6);
    let source = random_points(20, 1.0, &mut random);
    let (mut squares, mut predicted) = (0.0, 0.0);
    for _ in 0..2000 {
        let target: Vec<_> =
            source.iter().map(|p| p * 1.5 + Vector3::from_fn(|_, _| 1e-3 * normal(&mut random))).collect();
        let found = absolute_orientation_with_scale(&source, &target, None).unwrap();
        squares += (found.scale - 1.5).powi(2) / 2000.0;
        predicted += found.scale_sigma.powi(2) / 2000.0;
    }
    // Variance of 2000 samples: 3.2 %.
    assert!((squares / predicted - 1.0).abs() < 0.12, "{squares} {predicted}");
}

#[test]
fn weight_zero_leaves_a_pair_out() {
    let mut random = Pcg64::seed_from_u64(7);
    let source = random_points(6, 1.0, &mut random);
    let mut target = source.clone();
    target[2] += Vector3::new(5.0, 0.0, 0.0);
    let weights = [1.0, 1.0, 0.0, 1.0, 1.0, 1.0];
    let found = absolute_orientation(&source, &target, Some(&weights)).unwrap();
    assert!(found.rms_m < 1e-12);
    assert_eq!(found.redundancy, 9);
}

#[test]
fn what_cannot_be_solved_is_refused() {
    let line: Vec<_> = (0..10).map(|i| Point3::new(f64::from(i) * 0.1 + 1e3, 2.0 * f64::from(i), 5.0)).collect();
    assert!(matches!(
        absolute_orientation(&line, &line, None),
        Err(InputError::Collinear { what: "source points", .. })
    ));
    let same = vec![Point3::new(1.0, 2.0, 3.0); 5];
    assert!(matches!(absolute_orientation(&same, &same, None), Err(InputError::Collinear { .. })));
    assert!(matches!(
        absolute_orientation(&line[..2], &line[..2], None),
        Err(InputError::TooFewPoints { found: 2, .. })
    ));
    assert!(matches!(absolute_orientation(&[], &[], None), Err(InputError::TooFewPoints { found: 0, .. })));
    assert!(matches!(absolute_orientation(&line[..3], &line[..4], None), Err(InputError::LengthMismatch { .. })));
    let mut broken = line.clone();
    broken[3].y = f64::NAN;
    assert!(matches!(absolute_orientation(&broken, &line, None), Err(InputError::NonFinite { index: 3, .. })));
    let weights = vec![1.0, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    assert!(matches!(
        absolute_orientation(&line, &line, Some(&weights)),
        Err(InputError::NotPositive { index: 1, .. })
    ));
    // A cross in space against its mirror image: turns about several axes fit equally well.
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let cross: Vec<Point3<f64>> = axes.into_iter().flat_map(|v| [v, -v]).map(Point3::from).collect();
    let mirrored: Vec<_> = cross.iter().map(|p| Point3::from(-p.coords)).collect();
    assert!(matches!(absolute_orientation(&cross, &mirrored, None), Err(InputError::AmbiguousRotation { .. })));
}
