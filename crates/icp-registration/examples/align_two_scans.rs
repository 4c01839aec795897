//! Two scans of the corner of a room with a box in it, aligned point to plane: pose, its standard deviations, verdict.

#![allow(clippy::print_stdout)]

use icp_registration::{IcpOptions, align};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;

/// Points on floor, two walls and a box, every `spacing` metres from an offset of its own.
fn corner(spacing: f64, offset: f64) -> Vec<Point3<f64>> {
    let steps = (2.0 / spacing) as usize;
    let grid = (0..steps * steps).map(|k| {
        let [a, b] = [k % steps, k / steps].map(|i| offset + i as f64 * spacing);
        (a, b)
    });
    let faces = grid.flat_map(|(a, b)| {
        [
            Point3::new(a, b, 0.0),
            Point3::new(a, 0.0, b),
            Point3::new(0.0, a, b),
            Point3::new(0.8 + a / 4.0, 0.9, b / 4.0),
        ]
    });
    faces.collect()
}

fn main() -> Result<(), icp_registration::Error> {
    let target = Cloud::new(corner(0.04, 0.0));
    let truth = Isometry3::new(Vector3::new(0.06, -0.04, 0.03), Vector3::new(0.02, -0.03, 0.05));
    let source = Cloud::new(corner(0.05, 0.013)).transformed(&truth.inverse());

    let result = align(&source, &target, &Isometry3::identity(), &IcpOptions::default())?;
    let error = result.target_from_source.translation.vector - truth.translation.vector;
    println!("trustworthy: {} ({:?} after {} iterations)", result.is_trustworthy(), result.stop, result.iterations);
    println!("overlap {:.0} %, rms {:.2} mm", 100.0 * result.overlap, 1e3 * result.rms_m);
    println!("error of the translation: {:.3} mm", 1e3 * error.norm());
    for axis in 0..3 {
        println!("sigma of axis {axis}: {:.3} mm", 1e3 * result.covariance[(axis, axis)].sqrt());
    }
    Ok(())
}
