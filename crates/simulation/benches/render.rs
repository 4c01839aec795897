//! Rendering of one station and taking of one frame at three sizes.
#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use simulation::{SimulationSpec, Simulator};

/// The flagship room seen with another number of pixels on the same sensor.
fn room(width: usize, height: usize) -> SimulationSpec {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/scenes/room.ron");
    let mut spec = SimulationSpec::from_ron(&std::fs::read_to_string(path).unwrap()).unwrap();
    let format = &mut spec.camera.geometry.format;
    format.pixel_pitch_mm = [7.04 / width as f64, 5.76 / height as f64];
    (format.width, format.height) = (width, height);
    spec
}

fn render(criterion: &mut Criterion) {
    for (width, height) in [(176, 144), (640, 480), (1024, 1024)] {
        let size = format!("{width}x{height}");
        let mut one_ray = room(width, height);
        one_ray.errors.mixed_pixels = None;
        let simulator = Simulator::new(&one_ray).unwrap();
        let mut group = criterion.benchmark_group("Simulator");
        group.sample_size(10).throughput(Throughput::Elements((width * height) as u64));
        group.bench_function(BenchmarkId::new("station, one ray a pixel", &size), |b| {
            b.iter(|| simulator.station(0).unwrap());
        });
        let image = simulator.station(0).unwrap();
        group.bench_function(BenchmarkId::new("frame", &size), |b| b.iter(|| simulator.frame(&image, 0, 1).unwrap()));
        if width == 176 {
            let simulator = Simulator::new(&room(width, height)).unwrap();
            group.bench_function(BenchmarkId::new("station, 16 rays a pixel", &size), |b| {
                b.iter(|| simulator.station(0).unwrap());
            });
        }
    }
}

criterion_group!(benches, render);
criterion_main!(benches);
