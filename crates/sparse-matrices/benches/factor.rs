//! Factor and selected inverse of the matrix of a network.
#![allow(missing_docs)]

#[path = "../tests/networks.rs"]
mod networks;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn factor(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("factor");
    for count in [100, 1000] {
        let matrix = networks::corridors(count, 20);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(format!("{count} stations"), |bencher| bencher.iter(|| matrix.factor()));
        if let Some(factor) = matrix.factor() {
            group.bench_function(format!("{count} stations, inverse"), |bencher| {
                bencher.iter(|| factor.selected_inverse());
            });
        }
    }
    group.finish();
}

criterion_group!(benches, factor);
criterion_main!(benches);
