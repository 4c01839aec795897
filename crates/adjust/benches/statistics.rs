//! Statistics of calibration networks: 24 stations, 103 points, 453 unknowns; 100 stations, 700 points, 2700 unknowns.
//! One sight in 33 has a gross error.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use adjust::{
    DatumDefect, Moving, ReliabilityOptions, Scale, SnoopingOptions, SnoopingTest, SolveOptions, WeaknessOptions,
};
use common::{Plan, network_with_gross_errors};
use criterion::{Criterion, criterion_group, criterion_main};

fn statistics(criterion: &mut Criterion) {
    for (stations, points, seen) in [(24, 103, 43), (100, 700, 130)] {
        let plan = Plan { seed: 12, stations, points, seen, ranges: true, disturbance: 0.0 };
        let options = SolveOptions::default();
        let mut group = criterion.benchmark_group(format!("network of {stations} stations and {points} points"));
        group.sample_size(10);
        let (network, _) = network_with_gross_errors(&plan, 77);
        let solution = network.adjustment.solve(&options).unwrap();
        group.bench_function("test of all values", |b| {
            b.iter(|| solution.snoop(SnoopingTest::Baarda, 0.001).unwrap());
        });
        group.bench_function("reliability", |b| {
            b.iter(|| solution.reliability(&ReliabilityOptions::default()).unwrap());
        });
        let weakness = WeaknessOptions { blocks: Some(network.stations[..20].to_vec()), ..WeaknessOptions::default() };
        group.bench_function("weak combinations of 20 stations", |b| {
            b.iter(|| solution.near_defects(&weakness).unwrap());
        });
        let points = network.points.iter().map(|&point| Moving::Point(point));
        let moving: Vec<_> = points.chain(network.stations.iter().map(|&pose| Moving::Pose(pose))).collect();
        group.bench_function("covariances of all points in another datum", |b| {
            b.iter(|| {
                let other = solution.transformed_to(&network.points[..20], &moving, DatumDefect::Six).unwrap();
                network.points.iter().map(|&p| other.covariance(p, Scale::Prior).unwrap().trace()).sum::<f64>()
            });
        });
        for batch in if stations == 24 { vec![1, 256] } else { vec![256] } {
            let snooping = SnoopingOptions { batch, ..SnoopingOptions::default() };
            group.bench_function(format!("snooping, batches of {batch}"), |b| {
                b.iter_batched(
                    || network_with_gross_errors(&plan, 77).0.adjustment,
                    |mut a| a.solve_snooping(&options, &snooping).unwrap(),
                    criterion::BatchSize::LargeInput,
                );
            });
        }
        group.finish();
    }
}

criterion_group!(benches, statistics);
criterion_main!(benches);
