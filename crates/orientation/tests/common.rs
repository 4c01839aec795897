//! A camera, and stations around the origin.

use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

pub fn camera() -> Camera {
    Camera::new(
        ImageFormat::new(176, 144, [0.04, 0.04]).unwrap(),
        InteriorOrientation { principal_point_mm: [0.11, -0.07], principal_distance_mm: 8.0 },
        LensDistortion { k1: -2.1e-3, k2: 3.0e-5, p1: 1.2e-4, ..LensDistortion::default() },
    )
    .unwrap()
}

/// A camera at `eye` that looks at the origin, rolled.
pub fn looking_at(eye: [f64; 3], roll: f64) -> Isometry3<f64> {
    let eye = Vector3::from(eye);
    let rotation = UnitQuaternion::face_towards(&eye, &Vector3::y());
    Isometry3::from_parts(eye.into(), rotation * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll))
}

/// Where a camera at a pose sees a target, pixel.
pub fn seen(world_from_camera: &Isometry3<f64>, target: &Point3<f64>) -> [f64; 2] {
    camera().project(&world_from_camera.inverse_transform_point(target)).unwrap()
}

/// Standard normal numbers.
pub fn normals(seed: u64) -> impl FnMut() -> f64 {
    let mut generator = Pcg64::seed_from_u64(seed);
    move || StandardNormal.sample(&mut generator)
}
