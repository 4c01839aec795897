//! Frames of a simulated room.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod common;

use common::{Pinhole, Scene, cloud, disturbance, look_at, pose_error};
use icp_registration::{IcpOptions, align, pose_difference};

#[test]
fn room_pairs() {
    let scene = Scene::furnished();
    let camera = Pinhole::small();
    let pairs = [
        ([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8], [-1.2, -0.6, 1.5], [2.0, -0.2, 0.7]),
        ([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8], [-1.0, -1.2, 1.2], [1.6, 1.4, 0.9]),
        ([1.6, 0.2, 1.5], [-2.0, -0.5, 0.8], [1.3, 0.0, 1.3], [-2.0, 0.5, 0.6]),
    ];
    for (k, (p0, a0, p1, a1)) in pairs.iter().enumerate() {
        let (w0, w1) = (look_at(*p0, *a0), look_at(*p1, *a1));
        let truth = w0.inverse() * w1;
        for seed in 0..4u64 {
            let target = cloud(&scene, &camera, &w0, 1.0, 100 + seed);
            let source = cloud(&scene, &camera, &w1, 1.0, 200 + seed);
            let guess = disturbance(0.2, 8.0, seed) * truth;
            let t = std::time::Instant::now();
            let result = align(&source, &target, &guess, &IcpOptions::default()).unwrap();
            let e = pose_error(&result.target_from_source, &truth);
            let d = pose_difference(&result.target_from_source, &truth);
            let nees = d.dot(&(result.covariance.try_inverse().unwrap() * d));
            println!("{k} {seed} {:.2} mm {:.4} deg, it {} {:?} overlap {:.2} rms {:.1} mm n {} nees {:.1} {:?} lim {:.3} {:?}", e.0, e.1, result.iterations, result.stop, result.overlap, result.rms_m*1e3, result.correspondences, nees, result.degenerate, result.max_correspondence_distance_m, t.elapsed());
        }
    }
}
