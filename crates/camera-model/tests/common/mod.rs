//! Random but reasonable cameras, poses and points.
#![allow(dead_code, clippy::unwrap_used)]

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, pose_from_euler};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

/// The camera of the survey files: 176 x 144 pixels of 40 um, 8 mm lens with barrel distortion of a few pixels.
pub fn plain_camera() -> Camera {
    Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(),
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, k3: -4.0e-7, p1: 1.2e-4, p2: -0.8e-4, b1: 7.0e-4, b2: -4.0e-4 },
    )
    .unwrap()
}

/// Cameras with up to tens of pixels of distortion; at the corner each radial term reaches up to 5 % and each
/// decentring term up to 0.5 % of the radius, so that no model folds over inside the image.
pub fn cameras() -> impl Strategy<Value = Camera> {
    let size = (8_usize..400, 8_usize..400, 0.006..0.05_f64, 0.9..1.1_f64);
    let interior = (-0.04..0.04_f64, -0.04..0.04_f64, 0.6..3.0_f64);
    (size, interior, prop::array::uniform7(-1.0..1.0_f64)).prop_map(|(size, interior, lens)| {
        let (width, height, pitch, aspect) = size;
        let [half_width, half_height] = [width as f64 * pitch / 2.0, height as f64 * pitch * aspect / 2.0];
        let corner = half_width.hypot(half_height) * 1.05;
        let radial = |i: usize| 0.05 * lens[i] / corner.powi(2 * i as i32 + 2);
        let decentring = |i: usize| 0.005 * lens[i] / corner;
        Camera::new(
            ImageFormat::new(width, height, [pitch, pitch * aspect]).unwrap(),
            InteriorOrientation {
                principal_point_mm: [interior.0 * half_width, interior.1 * half_height],
                principal_distance_mm: interior.2 * corner,
            },
            LensDistortion {
                k1: radial(0),
                k2: radial(1),
                k3: radial(2),
                p1: decentring(3),
                p2: decentring(4),
                b1: 0.01 * lens[5],
                b2: 0.01 * lens[6],
            },
        )
        .unwrap()
    })
}

pub fn poses() -> impl Strategy<Value = Isometry3<f64>> {
    (prop::array::uniform3(-5.0..5.0_f64), prop::array::uniform3(-3.1..3.1_f64))
        .prop_map(|(position, angles)| pose_from_euler(Vector3::from(position), angles))
}

/// A camera, a pixel position on its image and a range.
pub fn pixels() -> impl Strategy<Value = (Camera, [f64; 2], f64)> {
    (cameras(), 0.0..1.0_f64, 0.0..1.0_f64, 0.1..20.0_f64).prop_map(|(camera, across, down, range)| {
        let [width, height] = [camera.format.width as f64, camera.format.height as f64];
        (camera, [across * width - 0.5, down * height - 0.5], range)
    })
}

/// The object point that a camera sees at a pixel and range from a pose.
pub fn object_point(camera: &Camera, pose: &Isometry3<f64>, pixel: [f64; 2], range: f64) -> Point3<f64> {
    pose * camera.point(pixel, range)
}
