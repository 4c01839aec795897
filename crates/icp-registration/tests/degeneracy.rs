//! Geometry that does not determine the pose, and how the result says so.

use crate::common::{Cuboid, Pinhole, Scene, cloud, look_at};
use icp_registration::{DegeneracyPolicy, IcpOptions, IcpResult, MotionKind, UndeterminedMotion, align};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Only the wall at x = 3 m is in view.
fn one_wall() -> (Scene, Isometry3<f64>, Isometry3<f64>) {
    let scene = Scene { room: Cuboid::new([-30.0, -30.0, -30.0], [3.0, 30.0, 30.0]), boxes: vec![] };
    (scene, look_at([0.0, 0.0, 0.0], [3.0, 0.2, 0.1]), look_at([0.1, 0.2, -0.1], [3.0, 0.3, 0.3]))
}

/// Two walls, floor and ceiling without an end: along x nothing changes.
fn corridor() -> (Scene, Isometry3<f64>, Isometry3<f64>) {
    let scene = Scene { room: Cuboid::new([-1e3, -1.0, 0.0], [1e3, 1.0, 2.4]), boxes: vec![] };
    (scene, look_at([0.0, 0.2, 1.4], [1.5, -1.0, 0.6]), look_at([0.2, 0.1, 1.3], [1.8, -1.0, 0.5]))
}

fn register(scene: &Scene, a: &Isometry3<f64>, b: &Isometry3<f64>, options: &IcpOptions, seed: u64) -> IcpResult {
    let camera = Pinhole::small();
    let target = cloud(scene, &camera, a, 1.0, 2 * seed + 1);
    let source = cloud(scene, &camera, b, 1.0, 2 * seed + 2);
    align(&source, &target, &(a.inverse() * b), options).unwrap()
}

fn count(motions: &[UndeterminedMotion], kind: MotionKind) -> usize {
    motions.iter().filter(|m| m.kind == kind).count()
}

#[test]
fn a_wall_leaves_two_slides_and_a_turn() {
    let (scene, a, b) = one_wall();
    for seed in 0..2 {
        let result = register(&scene, &a, &b, &IcpOptions::default(), seed);
        let motions = &result.degenerate;
        assert!(!result.is_trustworthy());
        assert_eq!(
            (count(motions, MotionKind::Translation), count(motions, MotionKind::Rotation)),
            (2, 1),
            "seed {seed}: {motions:?}"
        );
        let normal = a.rotation.inverse() * Vector3::x();
        for motion in motions {
            let across = motion.axis.dot(&normal).abs();
            match motion.kind {
                MotionKind::Translation => assert!(across < 0.05, "{across}"),
                MotionKind::Rotation => assert!(across > 0.95, "{across}"),
            }
        }
    }
}

#[test]
fn a_corridor_leaves_one_slide() {
    let (scene, a, b) = corridor();
    for seed in 0..2 {
        let result = register(&scene, &a, &b, &IcpOptions::default(), seed);
        assert_eq!(result.degenerate.len(), 1, "seed {seed}: {:?}", result.degenerate);
        assert_eq!(result.degenerate[0].kind, MotionKind::Translation);
        let along = a.rotation.inverse() * Vector3::x();
        assert!(result.degenerate[0].axis.dot(&along).abs() > 0.99);
        assert!(result.degenerate[0].sigma_m > 5e-3, "told in metres");
        // The covariance says it too.
        let slide = (along.transpose() * result.covariance.fixed_view::<3, 3>(0, 0) * along)[0].sqrt();
        assert!(slide > 5e-3, "{slide}");
    }
}

fn sphere(centre: Vector3<f64>, n: u32, noise: f64, seed: u64) -> Cloud {
    let mut random = Pcg64::seed_from_u64(seed);
    let points = (0..n)
        .map(|_| {
            let direction: Vector3<f64> = Vector3::from_fn(|_, _| StandardNormal.sample(&mut random)).normalize();
            let e: f64 = StandardNormal.sample(&mut random);
            Point3::from(centre + direction * (0.5 + noise * e))
        })
        .collect();
    Cloud::new(points)
}

#[test]
fn a_sphere_leaves_three_turns_about_its_centre() {
    let centre = Vector3::new(0.2, -0.3, 2.0);
    let source = sphere(Vector3::zeros(), 6000, 2e-3, 1);
    let target = sphere(centre, 6000, 2e-3, 2);
    let guess = Isometry3::translation(0.22, -0.29, 2.01);
    let result = align(&source, &target, &guess, &IcpOptions::default()).unwrap();
    assert_eq!(count(&result.degenerate, MotionKind::Rotation), 3, "{:?}", result.degenerate);
    assert_eq!(result.degenerate.len(), 3);
    for motion in &result.degenerate {
        assert!((motion.through.coords - centre).norm() < 0.02, "{}", motion.through);
    }
    // 12 000 points with 2 mm: 0.05 mm from noise; the uneven normals of 20 neighbours add a bend of 0.1 mm.
    assert!((result.target_from_source * Point3::origin() - centre).coords.norm() < 1e-3);
}

#[test]
fn a_furnished_room_leaves_nothing() {
    let scene = Scene::furnished();
    let a = look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]);
    let b = look_at([-1.2, -0.6, 1.5], [2.0, -0.2, 0.7]);
    for seed in 0..2 {
        let result = register(&scene, &a, &b, &IcpOptions::default(), seed);
        assert!(result.is_trustworthy(), "{:?} {:?}", result.stop, result.degenerate);
    }
}

#[test]
fn held_motions_stay_at_the_guess() {
    let (scene, a, b) = corridor();
    let camera = Pinhole::small();
    let target = cloud(&scene, &camera, &a, 1.0, 1);
    let source = cloud(&scene, &camera, &b, 1.0, 2);
    let truth = a.inverse() * b;
    let along = a.rotation.inverse() * Vector3::x();
    // 5 cm across the corridor and 7 cm along it.
    let across = a.rotation.inverse() * Vector3::new(0.0, 0.03, 0.04);
    let guess = Isometry3::from_parts((truth.translation.vector + across + along * 0.07).into(), truth.rotation);
    let options = IcpOptions { degeneracy: DegeneracyPolicy::HoldAtGuess, ..IcpOptions::default() };
    let result = align(&source, &target, &guess, &options).unwrap();
    let error = result.target_from_source.translation.vector - truth.translation.vector;
    // The guess kept along the axis to first order; across it what the walls say.
    assert!((error.dot(&along) - 0.07).abs() < 3e-3, "{}", error.dot(&along));
    assert!((error - along * error.dot(&along)).norm() < 2e-3, "{error}");
    assert_eq!(result.degenerate.len(), 1);
}
