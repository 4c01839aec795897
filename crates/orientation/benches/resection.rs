//! Resection of one station from 7 and from 100 targets, start value included.
#![allow(missing_docs)] // criterion's macro makes a public function

use std::hint::black_box;

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use orientation::{ResectionOptions, TargetObservation, resect};

fn station(count: usize) -> Result<(Camera, Vec<TargetObservation>), camera_model::Error> {
    let camera = Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04])?,
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, p1: 1.2e-4, ..LensDistortion::default() },
    )?;
    let pose = pose_from_euler(Vector3::new(0.4, -0.5, 3.0), [0.15, 0.1, 0.3]);
    let targets = (0..count).map(|i| {
        // A golden spiral over a field of 1.4 m, with waves in depth.
        let [radius, angle] = [0.7 * (i as f64 / count as f64).sqrt(), 2.4 * i as f64];
        let point = Point3::new(radius * angle.cos(), radius * angle.sin(), 0.2 * (3.0 * angle).sin());
        let seen = camera.observe(&pose, &point)?;
        // Rounding to a hundredth of a pixel and a millimetre stands for noise.
        let pixel = camera.format.pixel_from_image(seen.image_mm).map(|x| (x * 1e2).round() / 1e2);
        Ok(TargetObservation::new(point, pixel, 0.1).with_range((seen.range_m * 1e3).round() / 1e3, 0.005))
    });
    let targets = targets.collect::<Result<Vec<_>, camera_model::Error>>()?;
    Ok((camera, targets))
}

fn resections(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("resect");
    for count in [7, 100] {
        let Ok((camera, with_ranges)) = station(count) else { continue };
        group.throughput(Throughput::Elements(count as u64));
        let image_only: Vec<_> = with_ranges.iter().map(|t| TargetObservation { range: None, ..*t }).collect();
        for (name, targets) in [("ranges", &with_ranges), ("image_points", &image_only)] {
            group.bench_function(BenchmarkId::new(name, count), |b| {
                b.iter(|| resect(&camera, black_box(targets), &ResectionOptions::default()));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, resections);
criterion_main!(benches);
