//! The four closed forms that `[Eggert1997]` compares: noise, degenerate sets, and what rounding does.

use nalgebra::{Isometry3, Point3, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::{InputError, RotationMethod, absolute_orientation_by, pose_difference};

const METHODS: [RotationMethod; 4] = [
    RotationMethod::UnitQuaternion,
    RotationMethod::SingularValues,
    RotationMethod::OrthonormalMatrices,
    RotationMethod::DualQuaternions,
];

fn normal(random: &mut Pcg64) -> f64 {
    StandardNormal.sample(random)
}

/// Points with the given extents along the axes.
fn points(n: usize, extents: [f64; 3], random: &mut Pcg64) -> Vec<Point3<f64>> {
    (0..n).map(|_| Point3::from(Vector3::from_fn(|k, _| extents[k] * normal(random)))).collect()
}

fn pose(random: &mut Pcg64) -> Isometry3<f64> {
    Isometry3::new(Vector3::from_fn(|_, _| normal(random)), Vector3::from_fn(|_, _| normal(random)))
}

#[test]
fn with_noise_they_find_the_same_minimum() {
    let mut random = Pcg64::seed_from_u64(1);
    for (noise, n) in [(1e-3, 4), (1e-2, 20), (0.3, 100), (3.0, 100)] {
        for _ in 0..20 {
            let (source, truth) = (points(n, [1.0; 3], &mut random), pose(&mut random));
            let moved = source.iter().map(|p| truth * p + Vector3::from_fn(|_, _| noise * normal(&mut random)));
            let target: Vec<_> = moved.collect();
            let weights: Vec<f64> = (0..n).map(|i| 1.0 / (1 + i % 3) as f64).collect();
            let found = METHODS.map(|m| absolute_orientation_by(m, &source, &target, Some(&weights)).unwrap());
            for (method, other) in METHODS.iter().zip(&found) {
                let apart = pose_difference(&found[0].target_from_source, &other.target_from_source).norm();
                // One minimum; rounding magnified by the noise that brings the second best near (up to 1e5 here).
                assert!(apart < 1e-9, "{method:?} {noise} {n}: {apart}");
            }
        }
    }
}

#[test]
fn flat_and_mirrored_sets_get_a_rotation() {
    let mut random = Pcg64::seed_from_u64(2);
    for extents in [[1.0, 1.0, 0.0], [1.0, 0.1, 1e-9], [1.0, 0.01, 0.0]] {
        let (source, truth) = (points(12, extents, &mut random), pose(&mut random));
        let target: Vec<_> = source.iter().map(|p| truth * p).collect();
        for method in METHODS {
            let found = absolute_orientation_by(method, &source, &target, None).unwrap().target_from_source;
            // A width of a hundredth leaves the turn about the line a ten-thousandth of the moments, and a hundred
            // millionth where they are squared.
            assert!(pose_difference(&found, &truth).norm() < 1e-6, "{method:?} {extents:?}");
        }
    }
    // The best rotation onto a mirror image is no mirror.
    let source = points(30, [3.0, 2.0, 1.0], &mut random);
    let mirrored: Vec<_> = source.iter().map(|p| Point3::new(p.x, p.y, -p.z)).collect();
    let found = METHODS.map(|m| absolute_orientation_by(m, &source, &mirrored, None).unwrap());
    for other in &found {
        assert!(pose_difference(&found[0].target_from_source, &other.target_from_source).norm() < 1e-9);
        assert!((other.target_from_source.rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn rounding_tells_them_apart() {
    let mut random = Pcg64::seed_from_u64(3);
    let mut worst = |extents: [f64; 3], shift: f64| {
        METHODS.map(|method| {
            (0..50).fold(0.0, |worst: f64, _| {
                let away = Vector3::repeat(shift);
                let source: Vec<_> = points(10, extents, &mut random).iter().map(|p| p + away).collect();
                let truth = pose(&mut random);
                let target: Vec<_> = source.iter().map(|p| truth * p).collect();
                let found = absolute_orientation_by(method, &source, &target, None);
                let angle = found.map_or(f64::NAN, |f| f.target_from_source.rotation.angle_to(&truth.rotation));
                worst.max(angle)
            })
        })
    };
    let usual = worst([1.0; 3], 0.0);
    let thin = worst([1.0, 1e-4, 1e-4], 0.0);
    let far = worst([1.0; 3], 1e4);
    println!("worst angles: usual {usual:?}, nearly a line {thin:?}, 10 km away {far:?}");
    // Fully determined sets: all to rounding of sums of ten.
    assert!(usual.iter().all(|angle| *angle < 1e-7));
    // The turn about a line of width 1e-4 hangs on moments of 1e-8: eigenvalues keep half of the 16 digits of these.
    assert!(thin[0] < 1e-5 && thin[1] < 1e-5, "{thin:?}");
    // Squared moments of 1e-16 are rounding.
    assert!(thin[2].is_nan() || thin[2] > 1e3 * thin[1], "{thin:?}");
    // 10 km away a coordinate is known to 2e-12 m; dual quaternions square that distance before they subtract.
    assert!(far[..3].iter().all(|angle| *angle < 1e-7), "{far:?}");
    assert!(far[3] > 10.0 * far[0].max(f64::EPSILON), "{far:?}");
}

#[test]
fn what_has_no_answer_is_refused_by_all() {
    let line: Vec<_> = (0..9).map(|i| Point3::new(f64::from(i), 2.0 * f64::from(i), 1.0)).collect();
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let cross: Vec<Point3<f64>> = axes.into_iter().flat_map(|v| [v, -v]).map(Point3::from).collect();
    let mirrored: Vec<_> = cross.iter().map(|p| Point3::from(-p.coords)).collect();
    for method in METHODS {
        assert!(matches!(absolute_orientation_by(method, &line, &line, None), Err(InputError::Collinear { .. })));
        let ambiguous = absolute_orientation_by(method, &cross, &mirrored, None);
        assert!(matches!(ambiguous, Err(InputError::AmbiguousRotation { .. })), "{method:?}: {ambiguous:?}");
        let few = absolute_orientation_by(method, &line[..2], &line[..2], None);
        assert!(matches!(few, Err(InputError::TooFewPoints { .. })));
    }
}
