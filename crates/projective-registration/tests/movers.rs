//! Something that moves by itself before surfaces that are known less well.

use std::sync::Arc;

use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use rigid_pose::nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

const SIZE: [usize; 2] = [160, 120];
const FOCAL_PX: f64 = 130.0;

/// A room seen along its length from a pose, with a box before it whose sides stand 0.7 m off and whose middle is `box_x` aside; noise grows
/// with the square of the range.
fn seen(world_from_camera: &Isometry3<f64>, box_x: f64, seed: u64) -> OrganisedFrame {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let centre_px = SIZE.map(|side| (side as f64 - 1.0) / 2.0);
    let origin = world_from_camera.translation.vector;
    let (mut points, mut sigmas) = (Vec::new(), Vec::new());
    for k in 0..SIZE[0] * SIZE[1] {
        let u = ((k % SIZE[0]) as f64 - centre_px[0]) / FOCAL_PX;
        let v = (centre_px[1] - (k / SIZE[0]) as f64) / FOCAL_PX;
        let ray = Vector3::new(u, v, -1.0);
        let towards = world_from_camera.rotation * ray;
        let room = depth_to_box(&origin, &towards, [[-2.5, 2.5], [-1.5, 1.5], [-8.0, 9.0]]).1;
        let near = depth_to_box(&origin, &towards, [[box_x - 0.35, box_x + 0.35], [-1.5, 0.6], [-2.4, -1.9]]);
        let depth = if near.0 < near.1 && near.0 > 0.0 { near.0 } else { room };
        let sigma = 6e-4 * (depth * ray.norm()).powi(2);
        let noise: f64 = StandardNormal.sample(&mut random);
        points.push((ray * (depth + sigma * noise / ray.norm())).into());
        sigmas.push(sigma as f32);
    }
    let projection = Arc::new(Projection::pinhole(SIZE[0], SIZE[1], [FOCAL_PX; 2], centre_px).unwrap());
    OrganisedFrame::new::<f64>(&projection, &points, Some(&sigmas)).unwrap()
}

/// Where a ray comes into a box and out of it, in lengths of the ray.
fn depth_to_box(origin: &Vector3<f64>, ray: &Vector3<f64>, sides: [[f64; 2]; 3]) -> (f64, f64) {
    (0..3).fold((f64::NEG_INFINITY, f64::INFINITY), |(first, last), axis| {
        let [a, b] = sides[axis].map(|side| (side - origin[axis]) / ray[axis]);
        (first.max(a.min(b)), last.min(a.max(b)))
    })
}

fn off(pose: &Isometry3<f64>, truth: &Isometry3<f64>) -> f64 {
    let at = Point3::new(0.0, 0.0, -3.0);
    (pose * at - truth * at).norm()
}

#[test]
fn the_room_holds_where_a_box_moves_and_tells_the_poses_apart() {
    let start = Isometry3::identity();
    let moved = Isometry3::from_parts(
        Translation3::new(4e-3, -2e-3, 3e-3),
        UnitQuaternion::from_euler_angles(1e-3, -2e-3, 5e-4),
    );
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    for seed in 0..4 {
        let (target, source) = (seen(&start, 0.9, 2 * seed), seen(&moved, 0.94, 2 * seed + 1));
        let (near, _) = aligner.align_near(&source, &target, &moved).unwrap();
        let found = off(&near.target_from_source, &moved);
        assert!(found < 5e-3, "{seed}: {found}");
        let sigma = near.covariance.diagonal().map(f64::sqrt);
        assert!(sigma.iter().all(|sigma| (1e-5..5e-3).contains(sigma)), "{seed}: {sigma}");
        // A pose that follows the box: it turns about what lies behind.
        let along = Isometry3::from_parts(
            Translation3::new(-0.055, 0.0, 0.0),
            UnitQuaternion::from_euler_angles(0.0, -0.011, 0.0),
        ) * moved;
        let [right, wrong] = [moved, along].map(|pose| aligner.misfit(&source, &target, &pose).unwrap());
        assert!(right < 1.0 && wrong > 1.2 * right, "{seed}: {right} {wrong}");
    }
}

#[test]
fn frames_without_a_common_surface_have_no_misfit() {
    let start = Isometry3::identity();
    let frame = seen(&start, 0.9, 0);
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let behind = Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_euler_angles(0.0, 3.0, 0.0));
    assert_eq!(aligner.misfit(&frame, &frame, &behind), None);
    assert!(aligner.align_near(&frame, &frame, &behind).is_err());
}

#[test]
fn registrations_of_frames_of_one_size_allocate_once() {
    let (start, mut aligner) = (Isometry3::identity(), FrameAligner::new(FrameAlignmentOptions::default()).unwrap());
    let (target, source) = (seen(&start, 0.9, 0), seen(&start, 0.94, 1));
    // Allocations of other threads are not counted.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let mut all_ways = || {
            aligner.align(&source, &target, &start).unwrap();
            aligner.align_near(&source, &target, &start).unwrap();
            assert!(aligner.misfit(&source, &target, &start).is_some());
        };
        assert!(allocation_counter::measure(&mut all_ways).count_total > 0);
        assert_eq!(allocation_counter::measure(all_ways).count_total, 0);
    });
}
