//! Statistics of calibration networks: 24 stations, 103 points, 453 unknowns; 100 stations, 700 points, 2700 unknowns.
//! One sight in 33 has a gross error.
#![allow(missing_docs, clippy::unwrap_used)]

#[path = "../tests/common/mod.rs"]
mod common;

use adjust::{
    DatumDefect, Moving, ReliabilityOptions, Scale, SnoopingOptions, SnoopingTest, SolveOptions, WeaknessOptions,
};
use common::{Plan, network_with_gross_errors};
use criterion::{Bencher, Criterion, Throughput, criterion_group, criterion_main};

fn statistics(criterion: &mut Criterion) {
    for (stations, points, seen) in [(24, 103, 43), (100, 700, 130)] {
        let plan = Plan { seed: 12, stations, points, seen, ranges: true, disturbance: 0.0 };
        let options = SolveOptions::default();
        let (network, _) = network_with_gross_errors(&plan, 77);
        let solution = network.adjustment.solve(&options).unwrap();
        let size = format!("{stations} stations, {points} points");
        let mut bench = |entry: &str, measure: &mut dyn FnMut(&mut Bencher<'_>)| {
            let mut group = criterion.benchmark_group(entry);
            group.sample_size(10).throughput(Throughput::Elements(solution.observations() as u64));
            group.bench_function(&size, measure);
            group.finish();
        };
        bench("snoop", &mut |b| {
            b.iter(|| solution.snoop(SnoopingTest::Baarda, 0.001).unwrap());
        });
        bench("reliability", &mut |b| {
            b.iter(|| solution.reliability(&ReliabilityOptions::default()).unwrap());
        });
        let weakness = WeaknessOptions { blocks: Some(network.stations[..20].to_vec()), ..WeaknessOptions::default() };
        bench("near_defects of 20 stations", &mut |b| {
            b.iter(|| solution.near_defects(&weakness).unwrap());
        });
        let points = network.points.iter().map(|&point| Moving::Point(point));
        let moving: Vec<_> = points.chain(network.stations.iter().map(|&pose| Moving::Pose(pose))).collect();
        bench("transformed_to, covariances of all points", &mut |b| {
            b.iter(|| {
                let other = solution.transformed_to(&network.points[..20], &moving, DatumDefect::Six).unwrap();
                network.points.iter().map(|&p| other.covariance(p, Scale::Prior).unwrap().trace()).sum::<f64>()
            });
        });
        for batch in if stations == 24 { vec![1, 256] } else { vec![256] } {
            let snooping = SnoopingOptions { batch, ..SnoopingOptions::default() };
            bench(&format!("solve_snooping, batches of {batch}"), &mut |b| {
                b.iter_batched(
                    || network_with_gross_errors(&plan, 77).0.adjustment,
                    |mut a| a.solve_snooping(&options, &snooping).unwrap(),
                    criterion::BatchSize::LargeInput,
                );
            });
        }
    }
}

criterion_group!(benches, statistics);
criterion_main!(benches);
