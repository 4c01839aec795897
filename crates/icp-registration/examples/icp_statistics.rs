//! How often registrations succeed, how honest their covariances are, and whether open scenes are named.
//!
//! `cargo run --release -p icp-registration --features mesh --example icp_statistics [success|honesty|open|speed|mesh] [runs]`

#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs, unused)]

#[path = "../../point-cloud/tests/common/mod.rs"]
mod common;

use common::scenes::{half_overlapping_views, open_scene};
use common::{Pinhole, Scene, cloud, disturbance, frame_pair, pose_error};
use icp_registration::{Error, IcpOptions, IcpResult, IcpTarget, Metric};
use nalgebra::Isometry3;
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use rigid_pose::pose_difference;

const METRICS: [Metric; 4] =
    [Metric::PointToPlane, Metric::SymmetricPlanes, Metric::PlaneToPlane, Metric::PointToPoint];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let what = arguments.first().map_or("all", String::as_str);
    let runs = arguments.get(1).and_then(|n| n.parse().ok()).unwrap_or(200);
    let metrics: Vec<Metric> = match arguments.get(2).and_then(|k| k.parse::<usize>().ok()) {
        Some(k) => vec![METRICS[k]],
        None => METRICS.to_vec(),
    };
    for metric in metrics {
        let options = IcpOptions { metric, ..IcpOptions::default() };
        if what == "success" || what == "all" {
            success(&options, runs);
        }
        if what == "honesty" || what == "all" {
            honesty(&options, runs);
        }
        if what == "open" || what == "all" {
            open(&options, runs);
        }
    }
    if what == "speed" {
        speed();
    }
    #[cfg(feature = "mesh")]
    if what == "mesh" || what == "all" {
        mesh(runs);
    }
}

/// From 0.3 m and 20 degrees off, with half the points in common.
fn success(options: &IcpOptions, runs: u64) {
    let camera = Pinhole::small();
    let scene = Scene::furnished();
    let (mut right, mut trusted_wrong, mut iterations, mut left_out) = (0, 0, 0, 0);
    let start = std::time::Instant::now();
    for k in 0..runs {
        let (a, b) = half_overlapping_views(&camera, k);
        let target = IcpTarget::new(cloud(&scene, &camera, &a, 1.0, 2 * k)).unwrap();
        let source = cloud(&scene, &camera, &b, 1.0, 2 * k + 1);
        let truth = a.inverse() * b;
        // Half of the views may be a bare wall: that leaves the pose open from any start.
        let from_truth = target.align(&source, &truth, &IcpOptions::default());
        if !from_truth.as_ref().is_ok_and(|best| best.degenerate.is_empty()) {
            left_out += 1;
            continue;
        }
        let guess = disturbance(0.3, 20.0, 500 + k) * truth;
        match target.align(&source, &guess, options) {
            Ok(result) => {
                let (mm, degrees) = pose_error(&result.target_from_source, &truth);
                iterations += result.iterations;
                let good = mm < 30.0 && degrees < 1.0;
                right += u32::from(good);
                trusted_wrong += u32::from(!good && result.is_trustworthy());
                if !good {
                    let (overlap, rms) = from_truth.map_or((0.0, 0.0), |best| (best.overlap, best.rms_m));
                    println!(
                        "    pair {k}: {mm:.0} mm {degrees:.1} deg, overlap {:.2} rms {:.4}; from the truth {overlap:.2} {rms:.4}",
                        result.overlap, result.rms_m
                    );
                }
            }
            Err(error) => println!("    pair {k}: {error}"),
        }
    }
    println!(
        "success {:?}: {right} of {}; {left_out} pairs leave the pose open; wrong and trusted {trusted_wrong}; {:.1} iterations; {:.2} s a pair",
        options.metric,
        runs - left_out,
        iterations as f64 / runs as f64,
        start.elapsed().as_secs_f64() / runs as f64
    );
}

/// Time of preparing a target and of one alignment, frames with normals and bare points.
fn speed() {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one_thread.install(speeds);
}

fn speeds() {
    for (name, camera) in [("224x172", Pinhole::medium()), ("640x480", Pinhole::large())] {
        for bare in [false, true] {
            let (mut prepare, mut align, mut mm) = (vec![], vec![], vec![]);
            for k in 0..5 {
                let pair = frame_pair(&camera, k);
                let cloud = |frame: &(Vec<[f64; 3]>, Vec<f32>)| {
                    let normals =
                        organised_normals(&frame.0, camera.width, camera.height, &OrganisedNormalOptions::default());
                    let with = Cloud::from_frame(&frame.0, Some(&normals.unwrap()), Some(&frame.1)).unwrap();
                    if bare { Cloud::new(with.points) } else { with }
                };
                let (source, target) = (cloud(&pair.source), cloud(&pair.target));
                let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
                for _ in 0..3 {
                    let start = cpu_seconds();
                    let prepared = IcpTarget::new(target.clone()).unwrap();
                    let between = cpu_seconds();
                    let result = prepared.align(&source, &Isometry3::identity(), &IcpOptions::default()).unwrap();
                    let end = cpu_seconds();
                    (first, second) = (first.min(between - start), second.min(end - between));
                    mm.push(pose_error(&result.target_from_source, &pair.target_from_source).0);
                }
                prepare.push(1e3 * first);
                align.push(1e3 * second);
            }
            let [prepare, align, mm] = [prepare, align, mm].map(|mut values: Vec<f64>| {
                values.sort_by(f64::total_cmp);
                values[values.len() / 2]
            });
            let what = if bare { "bare points" } else { "with normals" };
            println!("speed {name} {what}: target {prepare:.0} ms, alignment {align:.0} ms, {mm:.2} mm");
        }
    }
}

/// CPU seconds of this thread.
fn cpu_seconds() -> f64 {
    std::thread::sleep(std::time::Duration::from_millis(1));
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let nanoseconds: f64 = text.split_whitespace().next().and_then(|word| word.parse().ok()).unwrap_or(f64::NAN);
    1e-9 * nanoseconds
}

/// Normalised squared errors of poses from close starts.
fn honesty(options: &IcpOptions, runs: u64) {
    let camera = Pinhole::small();
    let scene = Scene::furnished();
    let (mut sum, mut inside, mut count) = (0.0, 0, 0.0);
    for k in 0..runs {
        let (a, b) = near_views(&camera, k);
        let target = cloud(&scene, &camera, &a, 1.0, 7_000 + 2 * k);
        let source = cloud(&scene, &camera, &b, 1.0, 7_001 + 2 * k);
        let truth = a.inverse() * b;
        let guess = disturbance(0.01, 0.5, k) * truth;
        let options = IcpOptions { initial_correspondence_distance_m: Some(0.1), ..options.clone() };
        let Ok(result) = icp_registration::align(&source, &target, &guess, &options) else { continue };
        let error = pose_difference(&result.target_from_source, &truth);
        let square = error.dot(&(result.covariance.try_inverse().unwrap() * error));
        sum += square;
        count += 1.0;
        // 95 % of a chi-squared variable with 6 degrees of freedom.
        inside += u32::from(square < 12.592);
    }
    println!(
        "honesty {:?}: mean normalised squared error {:.2} of {count} (6 expected), {:.1} % within the 95 % ellipsoid",
        options.metric,
        sum / count,
        100.0 * f64::from(inside) / count
    );
}

/// Views of the room that share most of what they see.
fn near_views(camera: &Pinhole, k: u64) -> (Isometry3<f64>, Isometry3<f64>) {
    let (a, _) = half_overlapping_views(camera, k);
    (a, a * disturbance(0.25, 10.0, 90_000 + k))
}

/// Scenes that leave motions open must be named so.
fn open(options: &IcpOptions, runs: u64) {
    for kind in 0..5 {
        let (mut right, mut title, mut expected) = (0, "", 0);
        let mut found = [0; 7];
        for seed in 0..runs {
            let (name, source, target, truth, open) = open_scene(kind, seed);
            (title, expected) = (name, open);
            let guess = disturbance(0.02, 1.0, seed) * truth;
            match icp_registration::align(&source, &target, &guess, options) {
                Ok(result) => {
                    right += u32::from(result.degenerate.len() == open);
                    found[result.degenerate.len()] += 1;
                }
                Err(error) => println!("    {name} {seed}: {error}"),
            }
        }
        println!("open {:?}, {title}: {right} of {runs} name {expected}; counts {found:?}", options.metric);
    }
}

/// Frames in the model of the room.
#[cfg(feature = "mesh")]
fn mesh(runs: u64) {
    use icp_registration::Registration;
    use icp_registration::parts::{ClosestOnMesh, TriangleMesh};
    let (camera, scene) = (Pinhole::small(), Scene::furnished());
    let (vertices, triangles) = common::scenes::triangles(&scene);
    let model = TriangleMesh::new(&vertices, &triangles).unwrap();
    let registration = Registration::new(ClosestOnMesh::new(&model));
    let (mut sum, mut inside, mut count, mut right) = (0.0, 0, 0.0, 0);
    for k in 0..runs {
        let (truth, _) = half_overlapping_views(&camera, k);
        let source = cloud(&scene, &camera, &truth, 1.0, 9_000 + k);
        let guess = disturbance(0.3, 20.0, 600 + k) * truth;
        let Ok(result) = registration.align(&source, &guess) else { continue };
        let (mm, degrees) = pose_error(&result.target_from_source, &truth);
        if mm > 30.0 || degrees > 1.0 {
            println!("    frame {k}: {mm:.0} mm {degrees:.1} deg, {:?}", result.stop);
            continue;
        }
        right += 1;
        let error = pose_difference(&result.target_from_source, &truth);
        let square = error.dot(&(result.covariance.try_inverse().unwrap() * error));
        sum += square;
        count += 1.0;
        inside += u32::from(square < 12.592);
    }
    println!(
        "mesh: success {right} of {runs}; mean normalised squared error {:.2}, {:.1} % within the 95 % ellipsoid",
        sum / count,
        100.0 * f64::from(inside) / count
    );
}
