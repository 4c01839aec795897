//! Two views and networks of 16 and of 100 tie points; a mounting from 16 poses.
#![allow(missing_docs)] // criterion's macro makes a public function

use std::hint::black_box;

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Isometry3, Matrix6, Point3, Vector3};
use orientation::rigid_pose::Uncertain;
use orientation::{
    ImagePoint, MountingOptions, NetworkOptions, ObservedRange, RelativeOrientationOptions, TieObservation, TimedPose,
    estimate_mounting, orient_network, orient_two_views,
};

/// Three stations; rounding to a hundredth of a pixel and a millimetre stands for noise.
fn observations(targets: usize) -> Result<(Camera, Vec<TieObservation>), camera_model::Error> {
    let camera = Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04])?,
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, ..LensDistortion::default() },
    )?;
    let stations = [
        Isometry3::identity(),
        Isometry3::new(Vector3::new(0.9, 0.1, -0.2), Vector3::new(0.05, 0.3, -0.1)),
        Isometry3::new(Vector3::new(-0.7, 0.5, 0.1), Vector3::new(-0.15, -0.2, 0.4)),
    ];
    let mut out = Vec::new();
    for (station, pose) in stations.iter().enumerate() {
        for target in 0..targets {
            let t = target as f64;
            let point = Point3::new(0.8 * (2.0 * t).sin(), 0.6 * (3.1 * t).cos(), -3.2 + 0.7 * (5.3 * t).sin());
            let seen = camera.observe(pose, &point)?;
            let pixel = camera.format.pixel_from_image(seen.image_mm).map(|x| (x * 1e2).round() / 1e2);
            let range = Some(ObservedRange { range_m: (seen.range_m * 1e3).round() / 1e3, sigma_m: 1e-3 });
            out.push(TieObservation { station, target, image: ImagePoint::new(pixel, 0.01), range });
        }
    }
    Ok((camera, out))
}

fn relative(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("orient");
    for count in [16, 100] {
        let Ok((camera, with_ranges)) = observations(count) else { continue };
        group.throughput(Throughput::Elements(count as u64));
        let image_only: Vec<_> = with_ranges.iter().map(|seen| TieObservation { range: None, ..*seen }).collect();
        let view = |station: usize| -> Vec<ImagePoint> {
            with_ranges.iter().filter(|seen| seen.station == station).map(|seen| seen.image).collect()
        };
        let views = [view(0), view(1)];
        group.bench_function(BenchmarkId::new("orient_two_views", count), |b| {
            let options = RelativeOrientationOptions::default();
            b.iter(|| orient_two_views([&camera; 2], [black_box(&views[0]), &views[1]], &options));
        });
        for (name, observations) in [("ranges", &with_ranges), ("image_points", &image_only)] {
            group.bench_function(BenchmarkId::new(format!("orient_network/{name}"), count), |b| {
                b.iter(|| orient_network(&camera, black_box(observations), &NetworkOptions::default()));
            });
        }
    }
    group.finish();
}

fn mounting(criterion: &mut Criterion) {
    let carrier_from_camera = Isometry3::new(Vector3::new(0.05, 0.0, 0.12), Vector3::new(0.0, 0.0, 1.57));
    let covariance = Matrix6::identity() * 1e-6;
    let (mut carrier, mut camera) = (Vec::new(), Vec::new());
    for k in 0..16 {
        let t = f64::from(k);
        let at = Isometry3::new(
            Vector3::new(0.5, 0.3 * t.sin(), 0.8),
            Vector3::new(0.4 * t.cos(), 0.3 * (2.0 * t).sin(), 0.2),
        );
        carrier.push(TimedPose { time_s: t, pose: Uncertain { pose: at, covariance } });
        let seen = Isometry3::translation(1e-3 * (7.0 * t).sin(), 0.0, 0.0) * at * carrier_from_camera;
        camera.push(TimedPose { time_s: t, pose: Uncertain { pose: seen, covariance } });
    }
    let mut group = criterion.benchmark_group("mounting");
    group.throughput(Throughput::Elements(16));
    group.bench_function("estimate_mounting", |b| {
        b.iter(|| estimate_mounting(black_box(&carrier), &camera, &MountingOptions::default()));
    });
    group.finish();
}

criterion_group!(benches, relative, mounting);
criterion_main!(benches);
