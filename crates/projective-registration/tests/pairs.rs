//! Registration of organised frames on simulated frames with exact truth.

use std::sync::Arc;

use crate::common::scenes::half_overlapping_views;
use crate::common::{Cuboid, Pinhole, Scene, disturbance, frame, frame_pair, look_at, pose_error, sigma_of};
use crate::prepared::{pinhole, prepared};
use icp_registration::{IcpResult, MotionKind};
use nalgebra::{Isometry3, Vector3};
use projective_registration::{
    FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection, align_frames, frame_consistency,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::pose_difference;

fn align(source: &OrganisedFrame, target: &OrganisedFrame) -> IcpResult {
    align_frames(source, target, &Isometry3::identity(), &FrameAlignmentOptions::default()).unwrap()
}

#[test]
fn pairs_come_together_from_the_identity() {
    let camera = Pinhole::medium();
    let projection = pinhole(&camera);
    for k in 0..4 {
        let pair = frame_pair(&camera, k);
        let (target, source) = (prepared(&projection, &pair.target), prepared(&projection, &pair.source));
        let result = align(&source, &target);
        let (mm, degrees) = pose_error(&result.target_from_source, &pair.target_from_source);
        // Three times the median over twenty pairs (0.25 mm, 0.006 degrees).
        assert!(mm < 0.75 && degrees < 0.018, "pair {k}: {mm} mm, {degrees} degrees");
        assert!(result.is_trustworthy());
        assert!(result.overlap > 0.6 && result.rms_m > 0.0);
        let e = pose_difference(&result.target_from_source, &pair.target_from_source);
        let information = result.covariance.try_inverse().unwrap();
        let squared = e.dot(&(information * e));
        // Chi-squared with six degrees of freedom exceeds 25 once in three thousand.
        assert!(squared < 25.0, "pair {k}: {squared}");
        let options = FrameAlignmentOptions { noise_fraction: Some(2.0), ..FrameAlignmentOptions::default() };
        let early = align_frames(&source, &target, &Isometry3::identity(), &options).unwrap();
        let e = pose_difference(&early.target_from_source, &result.target_from_source);
        assert!(e.dot(&(information * e)) < 0.6, "a tenth of six, the noise: {e}");
    }
}

#[test]
fn without_sigma_the_pose_is_as_good() {
    let camera = Pinhole::medium();
    let (projection, pair) = (pinhole(&camera), frame_pair(&camera, 1));
    let target = OrganisedFrame::new(&projection, &pair.target.0, None).unwrap();
    let source = OrganisedFrame::new(&projection, &pair.source.0, None).unwrap();
    let (mm, degrees) = pose_error(&align(&source, &target).target_from_source, &pair.target_from_source);
    assert!(mm < 0.75 && degrees < 0.018, "{mm} mm, {degrees} degrees");
}

#[test]
fn a_frame_on_itself_and_back_and_forth() {
    let camera = Pinhole::small();
    let (projection, pair) = (pinhole(&camera), frame_pair(&camera, 2));
    let (target, source) = (prepared(&projection, &pair.target), prepared(&projection, &pair.source));
    let itself = align(&target, &target);
    assert!(
        itself.covariance.cholesky().is_some(),
        "no residual is left, and still a covariance: {}",
        itself.covariance
    );
    let itself = itself.target_from_source;
    // Residuals are zero; what is left is rounding in single precision at 3 m.
    assert!(itself.translation.vector.norm() < 1e-6 && itself.rotation.angle() < 1e-6, "{itself}");
    let there = align(&source, &target);
    let back = align(&target, &source).target_from_source;
    let (mm, degrees) = pose_error(&there.target_from_source, &back.inverse());
    // Both answers err by about the same; they share the noise.
    assert!(mm < 1.0 && degrees < 0.02, "{mm} mm, {degrees} degrees");
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let camera = Pinhole::large();
    let projection = pinhole(&camera);
    let pair = frame_pair(&camera, 3);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| align(&prepared(&projection, &pair.source), &prepared(&projection, &pair.target)))
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
    assert!(one.is_trustworthy());
}

#[test]
fn the_bits_of_pairs_in_doubt_do_not_depend_on_the_number_of_threads() {
    let camera = Pinhole::medium();
    let projection = pinhole(&camera);
    let mut doubted = 0;
    for k in 0..3 {
        let (a, b) = half_overlapping_views(&camera, k);
        let seen = |pose, seed| prepared(&projection, &frame(&Scene::furnished(), &camera, pose, 1.0, seed));
        let (target, source) = (seen(&a, 2 * k), seen(&b, 2 * k + 1));
        let guess = disturbance(0.3, 20.0, 500 + k) * (a.inverse() * b);
        let run = |threads: usize, search: bool| {
            let options = FrameAlignmentOptions { search, ..FrameAlignmentOptions::default() };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| align_frames(&source, &target, &guess, &options))
        };
        let one = run(1, true);
        assert_eq!(one, run(2, true), "pair {k}");
        // What leaves a motion open, or differs after a search, was in doubt.
        doubted += u32::from(run(1, false) != one || one.is_ok_and(|result| !result.degenerate.is_empty()));
    }
    assert!(doubted > 0, "no pair was in doubt");
}

#[test]
fn a_frame_that_is_used_again_answers_as_a_new_one() {
    let camera = Pinhole::small();
    let projection = pinhole(&camera);
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let (first, second) = (frame_pair(&camera, 4), frame_pair(&camera, 5));
    let mut target = prepared(&projection, &first.target);
    let mut source = prepared(&projection, &first.source);
    aligner.align(&source, &target, &Isometry3::identity()).unwrap();
    target.update(&second.target.0, Some(&second.target.1)).unwrap();
    source.update(&second.source.0, Some(&second.source.1)).unwrap();
    let again = aligner.align(&source, &target, &Isometry3::identity()).unwrap();
    assert_eq!(again, align(&prepared(&projection, &second.source), &prepared(&projection, &second.target)));
}

/// A frame of an otherwise empty world made of boxes.
fn world(boxes: Vec<Cuboid>, pose: &Isometry3<f64>, seed: u64) -> (Vec<[f64; 3]>, Vec<f32>) {
    let scene = Scene { room: Cuboid::new([-60.0; 3], [60.0; 3]), boxes };
    let (mut points, sigma) = frame(&scene, &Pinhole::medium(), pose, 1.0, seed);
    for p in &mut points {
        // Out of reach.
        if p[2] < -20.0 {
            *p = [f64::NAN; 3];
        }
    }
    (points, sigma)
}

fn degenerate(
    boxes: fn() -> Vec<Cuboid>,
    options: &FrameAlignmentOptions,
    guess: &Isometry3<f64>,
    seed: u64,
) -> IcpResult {
    let projection = pinhole(&Pinhole::medium());
    let camera = look_at([0.0, 0.0, 1.3], [3.0, 0.4, 0.9]);
    let moved = camera * disturbance(0.05, 2.0, 50 + seed);
    let target = prepared(&projection, &world(boxes(), &camera, 2 * seed));
    let source = prepared(&projection, &world(boxes(), &moved, 2 * seed + 1));
    align_frames(&source, &target, guess, options).unwrap()
}

fn wall() -> Vec<Cuboid> {
    vec![Cuboid::new([3.0, -50.0, -50.0], [4.0, 50.0, 50.0])]
}

fn wall_and_floor() -> Vec<Cuboid> {
    vec![Cuboid::new([3.0, -50.0, -50.0], [4.0, 50.0, 50.0]), Cuboid::new([-50.0, -50.0, -1.0], [50.0, 50.0, 0.0])]
}

fn corridor() -> Vec<Cuboid> {
    vec![
        Cuboid::new([-50.0, 1.0, -50.0], [50.0, 2.0, 50.0]),
        Cuboid::new([-50.0, -2.0, -50.0], [50.0, -1.0, 50.0]),
        Cuboid::new([-50.0, -50.0, -1.0], [50.0, 50.0, 0.0]),
    ]
}

#[test]
fn undetermined_motions_are_named_every_time() {
    for seed in 0..8 {
        for (name, boxes, slides, turns) in [
            ("wall", wall as fn() -> Vec<Cuboid>, 2, 1),
            ("wall and floor", wall_and_floor, 1, 0),
            ("corridor", corridor, 1, 0),
        ] {
            let result = degenerate(boxes, &FrameAlignmentOptions::default(), &Isometry3::identity(), seed);
            let count = |kind| result.degenerate.iter().filter(|m| m.kind == kind).count();
            let found = (count(MotionKind::Translation), count(MotionKind::Rotation));
            assert_eq!(found, (slides, turns), "{name}, seed {seed}: {:?}", result.degenerate);
            assert!(!result.is_trustworthy());
        }
    }
}

/// A frame of a ball or an endless upright column, 0.5 m in radius and 1.6 m before the camera; nothing behind it.
fn revolved(ball: bool, pose: &Isometry3<f64>, seed: u64) -> (Vec<[f64; 3]>, Vec<f32>) {
    let (camera, mut random) = (Pinhole::medium(), Pcg64::seed_from_u64(seed));
    // What of a vector counts for the distance from the middle: all of it, or all but the part along the axis.
    let across = |v: Vector3<f64>| if ball { v } else { Vector3::new(v.x, 0.0, v.z) };
    let from = across(pose.translation.vector + Vector3::z() * 1.6);
    let seen = |k: usize| {
        let ray = camera.ray(k % camera.width, k / camera.width);
        let direction = across(pose.rotation * ray);
        let (half, rest) = (from.dot(&direction), from.norm_squared() - 0.25);
        let range = (-half - (half * half - direction.norm_squared() * rest).sqrt()) / direction.norm_squared();
        let noise: f64 = StandardNormal.sample(&mut random);
        let point: [f64; 3] = (ray * (range + sigma_of(range) * noise)).into();
        // Rays that miss have no range.
        (point, sigma_of(range) as f32)
    };
    (0..camera.width * camera.height).map(seen).unzip()
}

#[test]
fn a_ball_and_a_column_leave_their_turns() {
    let projection = pinhole(&Pinhole::medium());
    for seed in 0..8 {
        for (ball, slides, turns) in [(true, 0, 3), (false, 1, 1)] {
            let moved = disturbance(0.04, 2.0, 150 + seed);
            let target = prepared(&projection, &revolved(ball, &Isometry3::identity(), 2 * seed));
            let source = prepared(&projection, &revolved(ball, &moved, 2 * seed + 1));
            let result = align(&source, &target);
            let count = |kind| result.degenerate.iter().filter(|m| m.kind == kind).count();
            let found = (count(MotionKind::Translation), count(MotionKind::Rotation));
            assert_eq!(found, (slides, turns), "ball {ball}, seed {seed}: {:?}", result.degenerate);
            assert!(!result.is_trustworthy());
        }
    }
}

#[test]
fn a_start_far_off_at_half_overlap_is_found() {
    let (camera, scene) = (Pinhole::small(), Scene::furnished());
    let projection = pinhole(&camera);
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let mut good = 0;
    for k in 0..6 {
        let (a, b) = half_overlapping_views(&camera, k);
        let target = prepared(&projection, &frame(&scene, &camera, &a, 1.0, 2 * k));
        let source = prepared(&projection, &frame(&scene, &camera, &b, 1.0, 2 * k + 1));
        let truth = a.inverse() * b;
        let result = aligner.align(&source, &target, &(truth * disturbance(0.3, 20.0, 300 + k))).unwrap();
        let (mm, degrees) = pose_error(&result.target_from_source, &truth);
        let is_good = mm < 30.0 && degrees < 1.0;
        // What is trusted is right.
        assert!(is_good || !result.is_trustworthy(), "pair {k}: {mm} mm, {degrees} degrees");
        good += u32::from(is_good);
        // At the truth the frames hardly contradict each other.
        let there = frame_consistency(&source, &target, &truth, 2);
        assert!((there.contradicting + there.unclear) * 50 < there.compared(), "pair {k}: {there:?}");
        assert!(there.agreeing * 3 > there.all(), "pair {k}: {there:?}");
        // Half a metre towards what is seen, surfaces stand where the other camera saw through.
        let wrong = truth * Isometry3::translation(0.0, 0.0, 0.5);
        let there = frame_consistency(&source, &target, &wrong, 2);
        assert!(there.contradicting * 5 > there.compared(), "pair {k}: {there:?}");
    }
    // Nine of ten over two hundred pairs.
    assert!(good >= 4, "{good} of 6");
}

/// Directions of a camera with barrel distortion.
fn distorted(camera: &Pinhole) -> Vec<[f64; 3]> {
    (0..camera.width * camera.height)
        .map(|k| {
            let ray = camera.ray(k % camera.width, k / camera.width);
            let (u, v) = (-ray.x / ray.z, -ray.y / ray.z);
            let r2 = u * u + v * v;
            let scale = 1.0 + 0.25 * r2 - 0.05 * r2 * r2;
            [2.0 * u * scale, 2.0 * v * scale, -2.0]
        })
        .collect()
}

#[test]
fn a_table_finds_the_pixels_of_a_distorted_camera() {
    let camera = Pinhole::small();
    let directions = distorted(&camera);
    let projection = Projection::from_directions(camera.width, camera.height, &directions).unwrap();
    for (k, d) in directions.iter().enumerate() {
        let [col, row] = projection.pixel(&(nalgebra::Point3::from(*d) * 1.7)).unwrap();
        let off = (col - (k % camera.width) as f64).hypot(row - (k / camera.width) as f64);
        // Bilinear reading of a table with one entry a pixel.
        assert!(off < 0.01, "pixel {k}: {off}");
    }
    assert!(projection.pixel(&nalgebra::Point3::new(0.0, 0.0, 1.0)).is_none());
    assert!(projection.pixel(&nalgebra::Point3::new(5.0, 0.0, -1.0)).is_none());
    assert!(projection.pixel(&nalgebra::Point3::new(f64::NAN, 0.0, -1.0)).is_none());
}

#[test]
fn frames_of_a_distorted_camera_come_together() {
    let camera = Pinhole::medium();
    let directions = distorted(&camera);
    let projection = Arc::new(Projection::from_directions(camera.width, camera.height, &directions).unwrap());
    let scene = Scene::furnished();
    let world_from_target = look_at([0.8, -0.5, 1.4], [-2.0, 1.4, 0.6]);
    let truth = disturbance(0.1, 4.0, 77);
    let seen = |pose: Isometry3<f64>| -> Vec<[f64; 3]> {
        directions
            .iter()
            .map(|d| {
                let ray = Vector3::from(*d).normalize();
                (ray * scene.range(&pose.translation.vector, &(pose.rotation * ray))).into()
            })
            .collect()
    };
    let target = OrganisedFrame::new(&projection, &seen(world_from_target), None).unwrap();
    let source = OrganisedFrame::new(&projection, &seen(world_from_target * truth), None).unwrap();
    let (mm, degrees) = pose_error(&align(&source, &target).target_from_source, &truth);
    // Without noise; creases are rounded by nodes of 2 x 2 pixels, 3 cm at 3 m.
    assert!(mm < 0.5 && degrees < 0.01, "{mm} mm, {degrees} degrees");
}

#[test]
fn the_rays_of_a_pinhole_are_recognised() {
    let camera = Pinhole::small();
    let directions: Vec<[f64; 3]> =
        (0..camera.width * camera.height).map(|k| camera.ray(k % camera.width, k / camera.width).into()).collect();
    let from_rays = Arc::new(Projection::from_directions(camera.width, camera.height, &directions).unwrap());
    let pair = frame_pair(&camera, 6);
    let result = align(&prepared(&from_rays, &pair.source), &prepared(&from_rays, &pair.target));
    let exact = pinhole(&camera);
    let expected = align(&prepared(&exact, &pair.source), &prepared(&exact, &pair.target));
    let (mm, degrees) = pose_error(&result.target_from_source, &expected.target_from_source);
    // Rounding of the rays.
    assert!(mm < 1e-2 && degrees < 1e-3, "{mm} mm, {degrees} degrees");
}

#[test]
fn the_scale_of_the_scene_does_not_matter() {
    let camera = Pinhole::small();
    let projection = pinhole(&camera);
    let pair = frame_pair(&camera, 7);
    let expected = align(&prepared(&projection, &pair.source), &prepared(&projection, &pair.target));
    for scale in [1e-3, 1e6] {
        let scaled = |f: &(Vec<[f64; 3]>, Vec<f32>)| {
            let points = f.0.iter().map(|p| p.map(|v| v * scale)).collect();
            prepared(&projection, &(points, f.1.iter().map(|s| s * scale as f32).collect()))
        };
        let found = align(&scaled(&pair.source), &scaled(&pair.target)).target_from_source;
        let unscaled = Isometry3::from_parts((found.translation.vector / scale).into(), found.rotation);
        let (mm, degrees) = pose_error(&unscaled, &expected.target_from_source);
        // Single precision, and a last step below the tolerance.
        assert!(mm < 0.02 && degrees < 1e-3, "{scale}: {mm} mm, {degrees} degrees");
    }
}
