//! Euler angles at the rim and computer-vision axes.

use std::f64::consts::{FRAC_PI_2, PI};

use camera_model::{
    computer_vision_from_photogrammetric, euler_from_pose, euler_from_rotation, pose_from_euler, rotation_from_euler,
    with_computer_vision_axes,
};
use nalgebra::{Matrix3, Point3, Vector3};
use proptest::prelude::*;

/// Eq. 2 written out.
fn eq_2(omega: f64, phi: f64, kappa: f64) -> Matrix3<f64> {
    let (s, c) = omega.sin_cos();
    let r1 = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, s, 0.0, -s, c);
    let (s, c) = phi.sin_cos();
    let r2 = Matrix3::new(c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c);
    let (s, c) = kappa.sin_cos();
    let r3 = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
    r3 * r2 * r1
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn euler_angles_there_and_back(omega in -3.1..3.1_f64, phi in -1.57..1.57_f64, kappa in -3.1..3.1_f64) {
        let rotation = rotation_from_euler(omega, phi, kappa);
        let matrix = *rotation.to_rotation_matrix().matrix();
        prop_assert!((matrix - eq_2(omega, phi, kappa)).norm() < 1e-14);
        let found = euler_from_rotation(&rotation);
        // Near phi = 90 degrees omega and kappa are known to rounding over cos(phi).
        let tolerance = 1e-14 / phi.cos();
        prop_assert!((found[0] - omega).abs() < tolerance && (found[2] - kappa).abs() < tolerance, "{:?}", found);
        prop_assert!((found[1] - phi).abs() < 1e-8);
        let pose = pose_from_euler(Vector3::new(1.0, 2.0, 3.0), [omega, phi, kappa]);
        prop_assert!((euler_from_pose(&pose)[0] - omega).abs() < tolerance);
        // The perspective centre is the camera frame's origin.
        prop_assert!((pose * Point3::origin() - Point3::new(1.0, 2.0, 3.0)).norm() < 1e-15);
    }

    #[test]
    fn at_the_singular_attitude_the_rotation_is_still_right(omega in -3.1..3.1_f64, kappa in -3.1..3.1_f64, up in any::<bool>()) {
        let phi = if up { FRAC_PI_2 } else { -FRAC_PI_2 };
        let rotation = rotation_from_euler(omega, phi, kappa);
        let [omega, phi, kappa] = euler_from_rotation(&rotation);
        // cos(phi) is lost in rounding there: the square root of it is left.
        prop_assert!(rotation.angle_to(&rotation_from_euler(omega, phi, kappa)) < 1e-7);
    }
}

#[test]
fn computer_vision_axes() {
    let turn = computer_vision_from_photogrammetric();
    assert_eq!(turn * Vector3::new(1.0, 2.0, -3.0), Vector3::new(1.0, -2.0, 3.0));
    assert!(turn.angle_to(&turn.inverse()) < 1e-15 && (turn.angle() - PI).abs() < 1e-15);
    let pose = pose_from_euler(Vector3::new(1.0, 2.0, 3.0), [0.1, 0.2, 0.3]);
    let optical = with_computer_vision_axes(&pose);
    // The same point in front: along +z for computer vision, along -z here.
    let [ahead, same] = [pose * Point3::new(0.1, 0.2, -2.0), optical * Point3::new(0.1, -0.2, 2.0)];
    assert!((ahead - same).norm() < 1e-15);
    assert!((with_computer_vision_axes(&optical).to_matrix() - pose.to_matrix()).norm() < 1e-15);
}
