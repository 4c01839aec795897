//! A flat wall 2 m in front of the camera: its ranges, its points, and what taking ranges for depths does to it.
#![allow(clippy::print_stdout)]

use camera_model::{
    Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable, euler_from_pose, point_covariance,
    pose_from_euler,
};
use nalgebra::{Point3, Vector3};
use range_image::{Flags, RangeFrame, Raster};

fn main() -> Result<(), camera_model::Error> {
    let camera = Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04])?,
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, k3: -4.0e-7, p1: 1.2e-4, p2: -0.8e-4, ..LensDistortion::default() },
    )?;
    let rays = RayTable::new(&camera)?;

    let depth = Raster::filled(176, 144, 2.0_f32);
    let right = frame(rays.depth_to_range(&depth)?);
    let wrong = frame(depth);
    for (name, frame) in [("ranges", &right), ("depths taken for ranges", &wrong)] {
        let cloud = rays.back_project(frame)?;
        let nearest = cloud.points.iter().map(|point| -point[2]).fold(f64::INFINITY, f64::min);
        let farthest = cloud.points.iter().map(|point| -point[2]).fold(0.0, f64::max);
        println!("{name}: the wall lies between {nearest:.4} m and {farthest:.4} m");
    }

    let corner = [0.0, 0.0];
    let range = f64::from(right.range[(0, 0)]);
    let covariance = point_covariance(&camera, corner, range, 0.004, [0.2, 0.2], None);
    let sigma = covariance.diagonal().map(f64::sqrt);
    println!(
        "corner pixel: range {range:.3} m, sigma x y z = {:.2} {:.2} {:.2} mm",
        sigma.x * 1e3,
        sigma.y * 1e3,
        sigma.z * 1e3
    );

    let world_from_camera = pose_from_euler(Vector3::new(0.0, -1.0, 1.5), [1.2, 0.1, 0.0]);
    let target = Point3::new(0.3, 1.4, 0.9);
    let (seen, jacobians) = camera.observe_with_jacobians(&world_from_camera, &target)?;
    let pixel = camera.format.pixel_from_image(seen.image_mm);
    println!("target seen at column {:.2}, row {:.2}, range {:.3} m", pixel[0], pixel[1], seen.range_m);
    println!(
        "d(x mm, y mm, range m) by a turn about the camera's x, per rad: {:.3?}",
        jacobians.pose.column(3).as_slice()
    );
    println!("omega, phi, kappa: {:.3?} rad", euler_from_pose(&world_from_camera));
    Ok(())
}

fn frame(range: Raster<f32>) -> RangeFrame {
    let (width, height) = (range.width(), range.height());
    RangeFrame {
        range,
        sigma: Raster::filled(width, height, 0.004),
        amplitude: Raster::filled(width, height, 700.0),
        flags: Raster::filled(width, height, Flags::empty()),
    }
}
