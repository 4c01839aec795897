//! Poses: Euler angles at the rim, tangent steps inside, and the way to computer-vision axes.
//!
//! A pose is an `Isometry3` called `world_from_camera`: its translation is the perspective centre `r_c`, its
//! rotation the transpose of the `R` of Eq. 2.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

/// The rotation `R = R3(kappa) R2(phi) R1(omega)` of Eq. 2 (radian), which maps object vectors to camera vectors.
pub fn rotation_from_euler(omega: f64, phi: f64, kappa: f64) -> UnitQuaternion<f64> {
    // The elementary rotations of Eq. 2 turn the axes, those of nalgebra the vectors: hence the signs.
    let about = |axis, angle: f64| UnitQuaternion::from_axis_angle(&axis, -angle);
    about(Vector3::z_axis(), kappa) * about(Vector3::y_axis(), phi) * about(Vector3::x_axis(), omega)
}

/// The angles `[omega, phi, kappa]` (radian) of an object-to-camera rotation, `phi` in [-pi/2, pi/2].
///
/// Where `phi` is +-pi/2 only one combination of the other two is determined; then `kappa` is zero.
pub fn euler_from_rotation(camera_from_object: &UnitQuaternion<f64>) -> [f64; 3] {
    let r = camera_from_object.to_rotation_matrix();
    let cos_phi = r[(0, 0)].hypot(r[(1, 0)]);
    let phi = r[(2, 0)].atan2(cos_phi);
    // Below this the quotients of the other entries are rounding noise.
    if cos_phi < 8.0 * f64::EPSILON {
        return [r[(1, 2)].atan2(r[(1, 1)]), phi, 0.0];
    }
    [(-r[(2, 1)]).atan2(r[(2, 2)]), phi, (-r[(1, 0)]).atan2(r[(0, 0)])]
}

/// The pose `world_from_camera` of a camera at `position` (metre) with angles `[omega, phi, kappa]` (radian) of Eq. 2.
///
/// The position is a `Vector3`, a `Point3` or a `[f64; 3]`.
pub fn pose_from_euler(position: impl Into<Translation3<f64>>, [omega, phi, kappa]: [f64; 3]) -> Isometry3<f64> {
    Isometry3::from_parts(position.into(), rotation_from_euler(omega, phi, kappa).inverse())
}

/// The angles `[omega, phi, kappa]` (radian) of Eq. 2 of a pose; see [`euler_from_rotation`].
pub fn euler_from_pose(world_from_camera: &Isometry3<f64>) -> [f64; 3] {
    euler_from_rotation(&world_from_camera.rotation.inverse())
}

/// Moves a pose by a tangent step `[dt (world axes, metre), dtheta (camera axes, radian)]`:
/// `r_c += dt`, `rotation = rotation * exp(dtheta)`. No attitude is singular for it.
pub fn step_pose(world_from_camera: &Isometry3<f64>, step: &[f64; 6]) -> Isometry3<f64> {
    let [tx, ty, tz, rx, ry, rz] = *step;
    let translation = world_from_camera.translation.vector + Vector3::new(tx, ty, tz);
    let mut rotation = world_from_camera.rotation * UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz));
    // Many steps one after the other must not drift away from unit length.
    rotation.renormalize();
    Isometry3::from_parts(translation.into(), rotation)
}

/// The rotation `diag(1, -1, -1)` between photogrammetric camera axes (x right, y up, looking along -z) and those
/// of computer vision (x right, y down, looking along +z; `OpenCV`, ROS, TUM). It is its own inverse.
pub fn computer_vision_from_photogrammetric() -> UnitQuaternion<f64> {
    // Half a turn about x, without rounding.
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0))
}

/// The pose of the same camera with computer-vision axes. The other way it is the same function.
pub fn with_computer_vision_axes(world_from_camera: &Isometry3<f64>) -> Isometry3<f64> {
    world_from_camera * computer_vision_from_photogrammetric()
}
