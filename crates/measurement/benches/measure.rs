//! Planes, cylinders and volumes from many points.

#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use measurement::nalgebra::{Matrix3, Point3, Unit, Vector3};
use measurement::point_uncertainty::{CommonErrors, PointErrors};
use measurement::{Base, Cloud, FitOptions, Region, VolumeOptions, fit_cylinder, fit_plane, volume};

struct OneSize;

impl PointErrors for OneSize {
    fn noise(&self, _: usize) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1e-6))
    }

    fn sensor(&self, point: usize) -> Option<(u64, Vector3<f64>)> {
        Some((point as u64 / 36, Vector3::z() * 1e-3))
    }

    fn common(&self, _: usize, _: &mut Vec<(usize, Vector3<f64>)>) {}
}

fn points(count: usize, height: impl Fn(f64) -> f64) -> Vec<Point3<f64>> {
    let side = (count as f64).sqrt() as usize;
    let at = |k: usize| [k % side, k / side].map(|at| (at as f64 + 0.5) / side as f64);
    let all = (0..side * side).map(|k| (k, at(k)));
    all.map(|(k, [x, y])| Point3::new(x, y, height(x) + 1e-3 * (k as f64 * 12.9898).sin())).collect()
}

fn measure(criterion: &mut Criterion) {
    let common = CommonErrors::none();
    let mut group = criterion.benchmark_group("measure");
    group.sample_size(10);
    for count in [1_000, 30_000] {
        group.throughput(Throughput::Elements(count as u64));
        let flat = points(count, |x| 0.1 * x);
        let round = points(count, |x| (1.0 - (x - 0.5).powi(2)).sqrt());
        let all: Vec<usize> = (0..flat.len()).collect();
        let cloud = |points| Cloud { points, errors: &OneSize, common: &common };
        group.bench_function(BenchmarkId::new("plane", count), |bencher| {
            bencher.iter(|| fit_plane(&cloud(&flat), &all, &FitOptions::default()));
        });
        group.bench_function(BenchmarkId::new("cylinder", count), |bencher| {
            bencher.iter(|| fit_cylinder(&cloud(&round), &all, &FitOptions::default()));
        });
        group.bench_function(BenchmarkId::new("volume", count), |bencher| {
            let region = Region::Box { from_m: [0.0, 0.0, -1.0], to_m: [1.0, 1.0, 2.0] };
            let base = Base::Fixed { point: Point3::origin(), normal: Unit::new_unchecked(Vector3::z()) };
            bencher.iter(|| volume(&cloud(&flat), &region, &base, &VolumeOptions { cell_m: 0.05 }));
        });
    }
    group.finish();
}

criterion_group!(benches, measure);
criterion_main!(benches);
