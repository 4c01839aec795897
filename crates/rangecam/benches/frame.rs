//! Whole frames from samples to corrected points, and each stage of them, on one thread.
#![allow(clippy::unwrap_used, missing_docs)]

mod stages;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use stages::{Frame, Unwrapping};

fn frames(criterion: &mut Criterion) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for (width, height) in [(176, 144), (640, 480), (1024, 1024)] {
        let mut group = criterion.benchmark_group(format!("frame/{width}x{height}"));
        group.throughput(Throughput::Elements((width * height) as u64));
        for (unwrapping, name) in Unwrapping::ALL {
            let mut frame = Frame::new(width, height, unwrapping).unwrap();
            // What is measured is a frame that comes out right; relative counts know the far side of jumps only.
            frame.run().unwrap();
            assert!(frame.right() > 0.5, "{name}: {}", frame.right());
            group.bench_function(format!("{name}/all stages"), |bencher| {
                bencher.iter(|| pool.install(|| frame.run()).unwrap());
            });
            for (stage_name, stage) in Frame::STAGES {
                group.bench_function(format!("{name}/{stage_name}"), |bencher| {
                    bencher.iter(|| pool.install(|| stage(&mut frame)).unwrap());
                });
            }
        }
    }
}

criterion_group!(benches, frames);
criterion_main!(benches);
