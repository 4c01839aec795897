//! Time of the registration of stations, by all surfaces at once and by pairs of frames, in points a second.

#![allow(missing_docs)] // criterion_group! makes a public function

use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use multiview_registration::{Datum, Start, StationRegistrationOptions, register_frames, register_stations};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use projective_registration::{FrameAlignmentOptions, OrganisedFrame, Projection};

const SIZE: (usize, usize) = (176, 144);
const STATIONS: usize = 4;

/// A wall at 3 m with a step along each axis, seen along the rays of a pinhole.
fn frame(world_from_camera: &Isometry3<f64>) -> Vec<[f64; 3]> {
    let (width, height) = SIZE;
    let seen = |k: usize| {
        let u = ((k % width) as f64 - 87.5) / width as f64;
        let v = (71.5 - (k / width) as f64) / width as f64;
        let mut depth = 3.0;
        for _ in 0..20 {
            let p = world_from_camera * Point3::new(u * depth, v * depth, -depth);
            depth += p.z + 3.0 + 0.1 * (1.5 * p.x).sin() + 0.08 * (2.0 * p.y).cos();
        }
        [u * depth, v * depth, -depth]
    };
    (0..width * height).map(seen).collect()
}

fn benches(criterion: &mut Criterion) {
    let (width, height) = SIZE;
    let pose = |k: usize| {
        let t = k as f64;
        Isometry3::new(Vector3::new(0.05 * t, -0.03 * t, 0.02 * t), Vector3::new(0.01 * t, 0.02 * t, -0.01 * t))
    };
    let poses: Vec<Isometry3<f64>> = (0..STATIONS).map(pose).collect();
    let points: Vec<Vec<[f64; 3]>> = poses.iter().map(frame).collect();
    let cloud = |points: &Vec<[f64; 3]>| {
        let normals = organised_normals(points, width, height, &OrganisedNormalOptions::default())?;
        Cloud::from_frame(points, Some(&normals), None)
    };
    let Ok(clouds) = points.iter().map(cloud).collect::<Result<Vec<Cloud>, _>>() else { return };
    let centre = [87.5, 71.5];
    let Ok(projection) = Projection::pinhole(width, height, [width as f64; 2], centre).map(Arc::new) else { return };
    let frame = |points: &Vec<[f64; 3]>| OrganisedFrame::new(&projection, points, None);
    let Ok(frames) = points.iter().map(frame).collect::<Result<Vec<OrganisedFrame>, _>>() else { return };
    let mut group = criterion.benchmark_group("Adjust");
    group.sample_size(10).throughput(Throughput::Elements((STATIONS * width * height) as u64));
    group.bench_function("register_stations", |bencher| {
        let options = StationRegistrationOptions::default();
        bencher
            .iter(|| register_stations(&clouds, Start::Poses(&poses), Datum::Station(0), &options, &|_, _| {}).is_ok());
    });
    group.bench_function("register_frames", |bencher| {
        let options = FrameAlignmentOptions::default();
        bencher.iter(|| register_frames(&frames, Start::Order, &options, &|_, _| {}).is_ok());
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
