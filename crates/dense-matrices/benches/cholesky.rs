//! Factors of positive matrices.
#![allow(missing_docs)]

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};

fn factors(criterion: &mut Criterion) {
    for n in [30, 300] {
        let element = |i: usize, j: usize| if i == j { n as f64 } else { (1.0 + (i * j) as f64).sin() };
        let matrix: Vec<f64> = (0..n * n).map(|k| element(k % n, k / n)).collect();
        criterion.bench_function(&format!("Cholesky of order {n}"), |bencher| {
            let factor = |matrix: &mut Vec<f64>| dense_matrices::cholesky(matrix, n);
            bencher.iter_batched_ref(|| matrix.clone(), factor, BatchSize::LargeInput);
        });
    }
}

criterion_group!(benches, factors);
criterion_main!(benches);
