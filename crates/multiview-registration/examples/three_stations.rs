//! Three stations around the corner of a room, from rough poses: how they stand, and how well that is known.

#![allow(clippy::print_stdout)]

use multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;

/// Points on floor, two walls and a box, every 4 cm from an offset of their own.
fn corner(offset: f64) -> Vec<Point3<f64>> {
    let grid = (0..50 * 50).map(|k| [k % 50, k / 50].map(|i| offset + f64::from(i) * 0.04));
    let faces = grid.flat_map(|[a, b]| {
        [
            Point3::new(a, b, 0.0),
            Point3::new(a, 0.0, b),
            Point3::new(0.0, a, b),
            Point3::new(0.8 + a / 4.0, 0.9, b / 4.0),
        ]
    });
    faces.collect()
}

fn main() -> Result<(), multiview_registration::Error> {
    let truth = [
        Isometry3::translation(1.0, 1.0, 1.0),
        Isometry3::new(Vector3::new(1.2, 0.8, 1.1), Vector3::new(0.0, 0.0, 0.2)),
        Isometry3::new(Vector3::new(0.9, 1.2, 0.9), Vector3::new(0.1, 0.0, -0.1)),
    ];
    let clouds: Vec<Cloud> = truth
        .iter()
        .zip([0.0, 0.013, 0.027])
        .map(|(pose, offset)| Cloud::new(corner(offset)).transformed(&pose.inverse()))
        .collect();
    let rough: Vec<Isometry3<f64>> = truth
        .iter()
        .enumerate()
        .map(|(k, pose)| pose * Isometry3::translation(0.02 * k as f64, -0.01 * k as f64, 0.0))
        .collect();
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, Start::Poses(&rough), Datum::Station(0), &options, &|_, _| {})?;
    for (k, (pose, truth)) in found.world_from_station.iter().zip(&truth).enumerate() {
        let off_mm = 1e3 * (pose.translation.vector - truth.translation.vector).norm();
        let sigma_mm = 1e3 * found.covariance[k].fixed_view::<3, 3>(0, 0).trace().sqrt();
        println!("station {k}: {off_mm:.2} mm off, {sigma_mm:.2} mm stated");
    }
    println!("redundancy {}, settled: {}", found.redundancy, found.settled);
    Ok(())
}
