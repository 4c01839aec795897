//! A page with a picture of a frame, by the size of the frame.

#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use report::{ColourMap, Document, Scale, raster_figure};

fn page(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("Document");
    for (width, height) in [(176, 144), (640, 480), (1024, 1024)] {
        let values: Vec<f64> = (0..width * height).map(|index| f64::from(index % 977)).collect();
        let scale = Scale { map: ColourMap::Sequential, low: 0.0, high: 977.0, unit: "mm" };
        group.throughput(Throughput::Elements(values.len() as u64));
        group.bench_with_input(BenchmarkId::from_parameter(format!("{width}x{height}")), &values, |bencher, values| {
            bencher.iter(|| {
                let mut document = Document::new("A frame", "");
                document.figures(raster_figure("Range", width as usize, values, &scale));
                document.html()
            });
        });
    }
    group.finish();
}

criterion_group!(benches, page);
criterion_main!(benches);
