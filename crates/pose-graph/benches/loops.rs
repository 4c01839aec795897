//! Time of the adjustment of a ring of poses that a registration closes, in poses a second.

#![allow(missing_docs)] // criterion_group! makes a public function

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use pose_graph::{Edge, Graph, Relation};
use projective_registration::ByField;
use rigid_pose::Uncertain;
use rigid_pose::nalgebra::{Isometry3, Matrix6, Vector3};

/// A way around in `count` steps, not yet closed, and the registration that closes it.
fn ring(count: usize) -> (Graph, Edge) {
    let turn = std::f64::consts::TAU / count as f64;
    let pose = Isometry3::new(Vector3::new(turn, 0.001, 0.0), Vector3::new(0.0, 0.0, turn));
    let random = Uncertain { pose, covariance: Matrix6::identity() * 1e-6 };
    let step = Relation { random, by_field: ByField::zeros() };
    let mut graph = Graph::at(Isometry3::identity());
    for k in 1..count {
        graph.add(k - 1, &step);
    }
    (graph, Edge { a: count - 1, b: 0, a_from_b: step, alike: 1.0 })
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Graph");
    for count in [10, 50, 100] {
        let (graph, closing) = ring(count);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::new("adjust_if_closed", count), |bencher| {
            bencher.iter_batched(
                || graph.clone(),
                |mut graph| {
                    graph.take([closing]);
                    graph.adjust_if_closed()
                },
                BatchSize::SmallInput,
            );
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
