//! Accuracy and CPU time of one thread, from raw points to the pose.

use std::time::Instant;

use nalgebra::Isometry3;
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame};

use super::common::{Pinhole, frame_pair, pose_error};
use super::{measure, median, projection};

/// Runs of which the fastest counts.
const RUNS: usize = 7;

pub fn print() {
    let mut rows = Vec::new();
    for (name, camera, count) in [("640x480", Pinhole::large(), 10), ("224x172", Pinhole::medium(), 20)] {
        let projection = projection(&camera);
        let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
        let (mut angles, mut distances, mut times, mut preparations) = (vec![], vec![], vec![], vec![]);
        let mut good = 0;
        for k in 0..count {
            let pair = frame_pair(&camera, k);
            let mut target = OrganisedFrame::new(&projection, &pair.target.0, Some(&pair.target.1)).unwrap();
            let mut source = OrganisedFrame::new(&projection, &pair.source.0, Some(&pair.source.1)).unwrap();
            let (mut least, mut least_preparation) = (f64::INFINITY, f64::INFINITY);
            let mut result = None;
            for _ in 0..RUNS {
                let ((), preparation) = measure::measured(|| {
                    target.update(&pair.target.0, Some(&pair.target.1)).unwrap();
                    source.update(&pair.source.0, Some(&pair.source.1)).unwrap();
                });
                let (r, time) = measure::measured(|| aligner.align(&source, &target, &Isometry3::identity()).unwrap());
                least = least.min(time + preparation);
                least_preparation = least_preparation.min(preparation);
                result = Some(r);
            }
            let result = result.unwrap();
            let (mm, degrees) = pose_error(&result.target_from_source, &pair.target_from_source);
            println!(
                "{name} {k:2}: {mm:7.3} mm {degrees:.4} deg {least:6.2} ms, {} iterations, {:?}, overlap {:.2}, \
                 undetermined {}",
                result.iterations,
                result.stop,
                result.overlap,
                result.degenerate.len()
            );
            angles.push(degrees);
            distances.push(mm);
            times.push(least);
            preparations.push(least_preparation);
            good += u32::from(mm < 30.0 && degrees < 1.0);
        }
        let [one, two] = threads(&camera);
        rows.push(format!(
            "| {name} | {good} of {count} | {:.3} | {:.4} | {:.2} | {:.2} | {one:.2} | {two:.2} |",
            median(&mut distances),
            median(&mut angles),
            median(&mut times),
            median(&mut preparations)
        ));
    }
    println!(
        "\n| pairs, medians | within 30 mm and 1° | mm | ° | CPU ms | of it both frames' | wall ms | two threads |"
    );
    println!("|---|---|---|---|---|---|---|---|\n{}", rows.join("\n"));
}

/// Runs of which the fastest counts where the wall time is measured.
const WALL_RUNS: usize = 60;

/// Wall time of one pair with one and with two threads, from raw points to the pose, millisecond.
fn threads(camera: &Pinhole) -> [f64; 2] {
    let (projection, pair) = (projection(camera), frame_pair(camera, 0));
    let prepared = |(points, sigma): &(Vec<[f64; 3]>, Vec<f32>)| OrganisedFrame::new(&projection, points, Some(sigma));
    let (mut target, mut source) = (prepared(&pair.target).unwrap(), prepared(&pair.source).unwrap());
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let pools = [1, 2].map(|count| rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap());
    let mut least = [f64::INFINITY; 2];
    for _ in 0..WALL_RUNS {
        for (pool, least) in pools.iter().zip(&mut least) {
            pool.install(|| {
                let start = Instant::now();
                target.update(&pair.target.0, Some(&pair.target.1)).unwrap();
                source.update(&pair.source.0, Some(&pair.source.1)).unwrap();
                aligner.align(&source, &target, &Isometry3::identity()).unwrap();
                *least = least.min(1e3 * start.elapsed().as_secs_f64());
            });
        }
    }
    least
}
