//! Frames of a simulated room with the noise of a time-of-flight camera.

use crate::common::{Pinhole, Scene, cloud, disturbance, look_at, pose_error};
use icp_registration::{IcpOptions, IcpTarget, Metric, Selection, StopReason, align};
use nalgebra::Isometry3;
use point_cloud::Cloud;
use rigid_pose::pose_difference;

/// Positions and points looked at of two frames; overlap 77, 58 and 64 %.
const VIEWS: [[[f64; 3]; 4]; 3] = [
    [[-1.5, -1.0, 1.4], [2.0, 0.8, 0.8], [-1.0, -1.2, 1.2], [1.6, 1.4, 0.9]],
    [[1.6, 0.2, 1.5], [-2.0, -0.5, 0.8], [1.3, 0.0, 1.3], [-2.0, 0.9, 0.6]],
    [[-1.5, -1.0, 1.4], [2.0, 0.8, 0.8], [-0.5, -1.2, 1.2], [2.0, -0.6, 0.5]],
];

struct View {
    target: Cloud,
    source: Cloud,
    target_from_source: Isometry3<f64>,
}

fn view(k: usize, seed: u64) -> View {
    let [p0, a0, p1, a1] = VIEWS[k];
    let (a, b) = (look_at(p0, a0), look_at(p1, a1));
    let (scene, camera) = (Scene::furnished(), Pinhole::small());
    View {
        target: cloud(&scene, &camera, &a, 1.0, 2 * seed),
        source: cloud(&scene, &camera, &b, 1.0, 2 * seed + 1),
        target_from_source: a.inverse() * b,
    }
}

#[test]
fn frames_come_together_from_20_cm_and_8_degrees() {
    for k in 0..VIEWS.len() {
        let view = view(k, 50 + k as u64);
        let target = IcpTarget::new(view.target).unwrap();
        for seed in 0..3 {
            let guess = disturbance(0.2, 8.0, 10 * seed + k as u64) * view.target_from_source;
            let result = target.align(&view.source, &guess, &IcpOptions::default()).unwrap();
            let (mm, degrees) = pose_error(&result.target_from_source, &view.target_from_source);
            println!("view {k} start {seed}: {mm:.2} mm {degrees:.4} deg, overlap {:.2}", result.overlap);
            assert!(mm < 2.0 && degrees < 0.03, "view {k} start {seed}: {mm} mm, {degrees} degrees");
            assert!(result.is_trustworthy(), "{:?} {:?}", result.stop, result.degenerate);
            assert_eq!(result.stop, StopReason::Converged);
            // Residuals of two points of 1 mm + 0.5 mm/m² each at 1 to 4 m, seen along the normal.
            assert!((4e-3..9e-3).contains(&result.rms_m), "{}", result.rms_m);
        }
    }
}

#[test]
fn the_covariance_is_honest() {
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 0..VIEWS.len() {
        for seed in 0..6 {
            let view = view(k, 1000 + 10 * k as u64 + seed);
            let start = disturbance(0.01, 0.5, seed) * view.target_from_source;
            let options = IcpOptions { initial_correspondence_distance_m: Some(0.1), ..IcpOptions::default() };
            let result = align(&view.source, &view.target, &start, &options).unwrap();
            let error = pose_difference(&result.target_from_source, &view.target_from_source);
            sum += error.dot(&(result.covariance.try_inverse().unwrap() * error));
            count += 1.0;
        }
    }
    // Six degrees of freedom: 6 expected; the mean of 18 trials scatters by 6 * sqrt(2 / 6 / 18) = 0.8.
    let mean = sum / count;
    println!("mean normalised squared error {mean:.2}");
    assert!((4.0..8.0).contains(&mean), "{mean}");
}

#[test]
fn points_to_points_is_coarser_but_says_so() {
    let view = view(0, 77);
    let start = disturbance(0.05, 2.0, 1) * view.target_from_source;
    let options = IcpOptions { metric: Metric::PointToPoint, ..IcpOptions::default() };
    let result = align(&view.source, &view.target, &start, &options).unwrap();
    let (mm, degrees) = pose_error(&result.target_from_source, &view.target_from_source);
    println!("{mm:.2} mm {degrees:.4} deg");
    // The pattern of pixels pulls: a quarter of the spacing of 25 mm at most.
    assert!(mm < 7.0 && degrees < 0.3, "{mm} {degrees}");
    let error = pose_difference(&result.target_from_source, &view.target_from_source);
    assert!(error.dot(&(result.covariance.try_inverse().unwrap() * error)) < 20.0);
}

#[test]
fn fewer_points_cost_accuracy_only() {
    let view = view(0, 78);
    let start = disturbance(0.1, 4.0, 2) * view.target_from_source;
    for selection in [Selection::EveryNth(8), Selection::NormalSpace(3000)] {
        let options = IcpOptions { selection, trim: 0.9, ..IcpOptions::default() };
        let result = align(&view.source, &view.target, &start, &options).unwrap();
        let (mm, degrees) = pose_error(&result.target_from_source, &view.target_from_source);
        println!("{selection:?}: {mm:.2} mm {degrees:.4} deg of {}", result.correspondences);
        // An eighth of the points: three times the deviation.
        assert!(mm < 5.0 && degrees < 0.1, "{selection:?}: {mm} {degrees}");
    }
}

#[test]
fn the_bits_do_not_depend_on_the_threads() {
    let view = view(1, 79);
    let start = disturbance(0.1, 4.0, 3) * view.target_from_source;
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| align(&view.source, &view.target, &start, &IcpOptions::default()).unwrap())
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(5));
}
