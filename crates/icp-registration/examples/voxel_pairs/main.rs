//! Registration of unorganised clouds by voxels: time, accuracy, capture, covariance and verdicts.
//!
//! `cargo run --release -p icp-registration --example voxel_pairs -- [frames] [capture] [covariance] [verdicts] [threads]
//! [easy] [dense COLUMNS RUNS FIRST] [lidar TARGET SOURCE]`; without words everything but the last two. Lidar scans are files of x, y, z as 64 bit floats.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

#[path = "../../../point-cloud/tests/common/mod.rs"]
mod common;
mod scenes;

use std::time::Duration;

use common::{Pinhole, frame_pair, pose_error};
use icp_registration::{IcpOptions, IcpResult, Metric, MotionKind, VoxelAlignmentOptions, VoxelCloud, align};
use nalgebra::{Isometry3, Matrix6, Point3, Vector6};
use point_cloud::Cloud;
use rigid_pose::pose_difference;
use scenes::{
    Views, bare, corridor, cylinder, far_off, half_overlapping, one_wall, parallel_walls, repeated, sphere,
    wall_and_floor,
};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| w == name);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let write = words.iter().position(|w| w == "write").map(|i| words[i + 1].clone());
    if wanted("frames") || write.is_some() {
        one_thread.install(|| frames("640x480", &Pinhole::large(), 10, write.as_deref()));
        one_thread.install(|| frames("224x172", &Pinhole::medium(), 20, write.as_deref()));
    }
    if wanted("capture") {
        capture();
    }
    if wanted("covariance") {
        covariance("one place", &Pinhole::medium(), 0..200, repeated);
        covariance("many places", &Pinhole::medium(), 1000..1200, places);
    }
    if let Some(at) = words.iter().position(|w| w == "dense") {
        let number = |k: usize, other: usize| words.get(at + k).and_then(|w| w.parse().ok()).unwrap_or(other);
        let (width, runs, first) = (number(1, 2580), number(2, 10), number(3, 3000));
        let camera = Pinhole { width, height: width * 3 / 4, focal_px: width as f64 * 530.0 / 640.0 };
        covariance(&format!("{width} columns"), &camera, first as u64..(first + runs) as u64, places);
    }
    if wanted("verdicts") {
        verdicts();
    }
    if wanted("threads") {
        threads();
    }
    if wanted("easy") {
        one_thread.install(|| easy("640x480", &Pinhole::large(), 6));
        one_thread.install(|| easy("224x172", &Pinhole::medium(), 12));
    }
    if let Some(i) = words.iter().position(|w| w == "lidar") {
        one_thread.install(|| lidar(&words[i + 1], &words[i + 2]));
    }
}

/// From raw points to the pose.
fn register(
    views: &Views,
    guess: &Isometry3<f64>,
    options: &VoxelAlignmentOptions,
) -> Result<IcpResult, icp_registration::Error> {
    let target = VoxelCloud::new(&views.target, None)?;
    let source = VoxelCloud::new(&views.source, None)?;
    target.align(&source, guess, options)
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// CPU seconds of this thread.
fn cpu_seconds() -> f64 {
    let read = || {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        let mut words = text.split_whitespace().map(str::parse::<f64>);
        Some((words.next()?.ok()?, words.nth(1)?.ok()?))
    };
    let Some((_, turns)) = read() else { return f64::NAN };
    // The system counts up to the last change of threads: sleep until there was one.
    loop {
        std::thread::sleep(Duration::from_micros(50));
        match read() {
            Some((nanoseconds, now)) if now > turns => return 1e-9 * nanoseconds,
            Some(_) => {}
            None => return f64::NAN,
        }
    }
}

/// Result and least CPU time of some runs, milliseconds.
fn timed<T>(runs: usize, mut work: impl FnMut() -> T) -> (T, f64) {
    let mut least = f64::INFINITY;
    let mut result = None;
    for _ in 0..runs {
        let start = cpu_seconds();
        result = Some(work());
        least = least.min(1e3 * (cpu_seconds() - start));
    }
    (result.unwrap(), least)
}

fn frames(name: &str, camera: &Pinhole, count: u64, write: Option<&str>) {
    let near = VoxelAlignmentOptions { max_start_error_m: Some(0.3), ..VoxelAlignmentOptions::default() };
    for (what, options) in [("from afar", VoxelAlignmentOptions::default()), ("start within 0.3 m", near)] {
        let (mut ms, mut mm, mut degrees, mut good) = (vec![], vec![], vec![], 0);
        let mut prepare = vec![];
        for k in 0..count {
            let pair = frame_pair(camera, k);
            let target_from_source = pair.target_from_source;
            let views = Views { source: bare(&pair.source.0), target: bare(&pair.target.0), target_from_source };
            if let Some(folder) = write {
                save(&format!("{folder}/{name}_{k}"), &views);
            }
            let (_, one) = timed(3, || VoxelCloud::new(&views.target, None));
            prepare.push(one);
            let (result, least) = timed(3, || register(&views, &Isometry3::identity(), &options));
            let result = result.unwrap();
            let (a, b) = pose_error(&result.target_from_source, &target_from_source);
            ms.push(least);
            mm.push(a);
            degrees.push(b);
            good += usize::from(a < 30.0 && b < 1.0);
        }
        println!(
            "{name} {what}: {:.1} ms (one cloud {:.1} ms), median {:.4} deg {:.2} mm, {good} of {count}",
            median(&mut ms),
            median(&mut prepare),
            median(&mut degrees),
            median(&mut mm)
        );
    }
}

/// Files that other programs can be run on: points and pose as 64 bit floats.
/// The easy tier by points and as it chooses, from raw points to the pose.
fn easy(name: &str, camera: &Pinhole, count: u64) {
    for metric in [Metric::PointToPlane, Metric::Automatic] {
        let options = IcpOptions { metric, ..IcpOptions::default() };
        let (mut millimetres, mut degrees, mut times) = (vec![], vec![], vec![]);
        for k in 0..count {
            let pair = frame_pair(camera, k);
            let (source, target) = (bare(&pair.source.0), bare(&pair.target.0));
            let (result, time) = timed(1, || align(&source, &target, &Isometry3::identity(), &options).unwrap());
            let (a, b) = pose_error(&result.target_from_source, &pair.target_from_source);
            millimetres.push(a);
            degrees.push(b);
            times.push(time);
        }
        let [mm, degree, ms] = [&mut millimetres, &mut degrees, &mut times].map(|values| median(values));
        println!("{name} {metric:?}: median {mm:.3} mm {degree:.4} deg {ms:.1} ms");
    }
}

fn save(stem: &str, views: &Views) {
    let bytes = |cloud: &Cloud| -> Vec<u8> {
        cloud.points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f64::to_le_bytes).collect()
    };
    std::fs::write(format!("{stem}_t.bin"), bytes(&views.target)).unwrap();
    std::fs::write(format!("{stem}_s.bin"), bytes(&views.source)).unwrap();
    let pose = views.target_from_source.to_homogeneous().transpose();
    std::fs::write(format!("{stem}_g.bin"), pose.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
}

fn capture() {
    let camera = Pinhole::medium();
    for (metre, degrees) in [(0.1, 7.0), (0.3, 20.0), (0.5, 30.0)] {
        let (mut good, mut claimed, mut refused, mut open) = (0, 0, 0, 0);
        let (mut mm, mut lost) = (vec![], vec![]);
        for seed in 0..200 {
            let views = half_overlapping(&camera, seed);
            let guess = far_off(&views, metre, degrees, seed);
            match register(&views, &guess, &VoxelAlignmentOptions::default()) {
                Ok(result) => {
                    let (a, b) = pose_error(&result.target_from_source, &views.target_from_source);
                    if a < 30.0 && b < 1.0 {
                        good += 1;
                        mm.push(a);
                    } else {
                        claimed += usize::from(result.is_trustworthy());
                        lost.push(seed);
                        // What is in common may leave the pose open from any start.
                        let at_truth = register(&views, &views.target_from_source, &VoxelAlignmentOptions::default());
                        open += usize::from(at_truth.is_ok_and(|result| !result.degenerate.is_empty()));
                    }
                }
                Err(_) => refused += 1,
            }
        }
        let mm = median(&mut mm);
        println!(
            "capture {metre} m {degrees} deg: {good} of 200 (median {mm:.2} mm); wrong but trusted {claimed}, refused {refused}, lost {lost:?}, of which {open} are open at the truth"
        );
    }
}

/// Two views from a place of their own.
fn places(camera: &Pinhole, seed: u64) -> Views {
    let pair = frame_pair(camera, seed);
    let target_from_source = pair.target_from_source;
    Views { source: bare(&pair.source.0), target: bare(&pair.target.0), target_from_source }
}

/// Errors over what is stated: the mean normalised square should be 6, and `errors over stated` 1.
fn covariance(name: &str, camera: &Pinhole, seeds: std::ops::Range<u64>, views: impl Fn(&Pinhole, u64) -> Views) {
    let runs = seeds.end - seeds.start;
    let (mut millimetres, mut stated, mut times) = (vec![], vec![], vec![]);
    let (mut nees, mut inside, mut used) = (0.0, 0, 0);
    let (mut all, mut errors, mut inverses) = (vec![], vec![], Matrix6::zeros());
    for seed in seeds {
        let views = views(camera, seed);
        let guess = &views.target_from_source;
        let (result, ms) = timed(1, || register(&views, guess, &VoxelAlignmentOptions::default()));
        let Ok(result) = result else { continue };
        times.push(ms);
        if !result.is_trustworthy() {
            continue;
        }
        let error = pose_difference(&views.target_from_source, &result.target_from_source);
        let Some(inverse) = result.covariance.try_inverse() else { continue };
        let square = error.dot(&(inverse * error));
        millimetres.push(1e3 * error.fixed_rows::<3>(0).norm());
        stated.push(1e3 * result.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt());
        nees += square;
        all.push(square);
        errors.push(error);
        inverses += inverse;
        // 95 % quantile of the chi-squared distribution with 6 degrees of freedom.
        inside += usize::from(square < 12.592);
        used += 1;
    }
    let used = f64::from(used);
    println!(
        "covariance, {name}: {used} of {runs} trusted, {:.2} mm, stated {:.2}, {:.0} ms, normalised squared error {:.2} (median {:.2}), 95 % ellipses cover {:.1} %",
        median(&mut millimetres),
        median(&mut stated),
        median(&mut times),
        nees / used,
        median(&mut all),
        100.0 * inside as f64 / used
    );
    // What all errors share, if the place is the same.
    let mean = errors.iter().fold(Vector6::zeros(), |sum, e| sum + e / used);
    println!("  errors over stated {:.2} rms", (nees / (6.0 * used)).sqrt());
    println!("  of which the mean error {:.2}", mean.dot(&(inverses / used * mean)));
}

/// Draws the views of a scene.
type MakeViews = fn(&Pinhole, u64) -> Views;

fn verdicts() {
    let camera = Pinhole::medium();
    let scenes: [(&str, MakeViews, [usize; 2]); 7] = [
        ("one wall", one_wall, [2, 1]),
        ("wall and floor", wall_and_floor, [1, 0]),
        ("corridor", corridor, [1, 0]),
        ("two parallel walls", parallel_walls, [2, 1]),
        ("sphere", sphere, [0, 3]),
        ("cylinder", cylinder, [1, 1]),
        ("furnished room", repeated, [0, 0]),
    ];
    for (name, views, expected) in scenes {
        let mut right = 0;
        for seed in 0..50 {
            let views = views(&camera, seed);
            let motions = register(&views, &views.target_from_source, &VoxelAlignmentOptions::default())
                .map_or_else(|_| vec![], |result| result.degenerate);
            let found = [MotionKind::Translation, MotionKind::Rotation]
                .map(|kind| motions.iter().filter(|m| m.kind == kind).count());
            right += usize::from(found == expected);
            if found != expected {
                println!("  {seed} {motions:?}");
            }
        }
        println!("verdict, {name}: {right} of 50 right");
    }
}

fn threads() {
    let pair = frame_pair(&Pinhole::large(), 0);
    let target_from_source = pair.target_from_source;
    let views = Views { source: bare(&pair.source.0), target: bare(&pair.target.0), target_from_source };
    let mut first = None;
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut least = f64::INFINITY;
        for _ in 0..15 {
            let start = std::time::Instant::now();
            let result =
                pool.install(|| register(&views, &Isometry3::identity(), &VoxelAlignmentOptions::default()).unwrap());
            least = least.min(1e3 * start.elapsed().as_secs_f64());
            assert_eq!(*first.get_or_insert(result.clone()), result, "the same bits");
        }
        println!("{threads} threads: {least:.1} ms of wall time");
    }
}

fn lidar(target: &str, source: &str) {
    let read = |path: &str| {
        let bytes = std::fs::read(path).unwrap();
        let numbers: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        Cloud::new(numbers.chunks_exact(3).map(|p| Point3::new(p[0], p[1], p[2])).collect())
    };
    let views = Views { source: read(source), target: read(target), target_from_source: Isometry3::identity() };
    for voxel_m in [None, Some(0.25), Some(0.5), Some(1.0)] {
        let options = VoxelAlignmentOptions { max_start_error_m: Some(1.0), ..VoxelAlignmentOptions::default() };
        let (result, ms) = timed(5, || {
            let target = VoxelCloud::new(&views.target, voxel_m).unwrap();
            let source = VoxelCloud::new(&views.source, voxel_m).unwrap();
            (target.align(&source, &Isometry3::identity(), &options), target.voxel_m(), target.len())
        });
        println!("lidar, voxels {:.3} m ({}): {ms:.1} ms", result.1, result.2);
        match result.0 {
            Ok(found) => {
                let (place, turn) = (found.target_from_source.translation, found.target_from_source.rotation);
                let sigma = found.covariance.diagonal().map(f64::sqrt);
                println!("  {:.4?} m, {:.5?} rad, sigma {:.5?}", place.vector, turn.scaled_axis(), sigma.as_slice());
                let verdict: Vec<_> = found.degenerate.iter().map(|m| m.kind).collect();
                println!(
                    "  {} pairs, {} iterations, {:?}, {verdict:?}",
                    found.correspondences, found.iterations, found.stop
                );
            }
            Err(error) => println!("  {error}"),
        }
    }
}
