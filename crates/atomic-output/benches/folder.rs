//! Folders of results that replace older ones.
#![allow(missing_docs, clippy::unwrap_used)]

use atomic_output::{Destination, write_text};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn folder(criterion: &mut Criterion) {
    let scratch = tempfile::tempdir().unwrap();
    let target = scratch.path().join("out");
    let mut group = criterion.benchmark_group("commit");
    for files in [1_u64, 20] {
        group.sample_size(10).throughput(Throughput::Elements(files));
        group.bench_function(format!("{files} files"), |bencher| {
            bencher.iter(|| {
                let output = Destination::new(&target, &[scratch.path().join("in")]).unwrap().open().unwrap();
                for file in 0..files {
                    write_text(output.file(format!("{file}.txt")).unwrap(), "result\n").unwrap();
                }
                output.commit().unwrap();
            });
        });
    }
    group.finish();
}

criterion_group!(benches, folder);
criterion_main!(benches);
