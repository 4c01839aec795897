//! Factors of positive matrices.
#![allow(missing_docs)]

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

fn factors(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("cholesky");
    for n in [30, 300] {
        let element = |i: usize, j: usize| if i == j { n as f64 } else { (1.0 + (i * j) as f64).sin() };
        let matrix: Vec<f64> = (0..n * n).map(|k| element(k % n, k / n)).collect();
        group.throughput(Throughput::Elements((n * n) as u64));
        group.bench_function(format!("order {n}"), |bencher| {
            let factor = |matrix: &mut Vec<f64>| dense_matrices::cholesky(matrix, n);
            bencher.iter_batched_ref(|| matrix.clone(), factor, BatchSize::LargeInput);
        });
    }
    group.finish();
}

criterion_group!(benches, factors);
criterion_main!(benches);
