//! Derivatives of contacts.

#![allow(clippy::unwrap_used)]
use super::*;
use nalgebra::Point3;
use point_cloud::Cloud;
use rigid_pose::step_pose;

#[test]
fn the_derivative_of_a_contact_agrees_with_differences() {
    let points: Vec<Point3<f64>> =
        (0..900).map(|i| Point3::new(f64::from(i % 30) * 0.02, f64::from(i / 30) * 0.02, 1.0)).collect();
    let cloud = Cloud::new(points);
    let surface = Surface::new(&cloud, &vec![Vector3::z(); 900], 0.1).unwrap();
    let pose = Isometry3::new(Vector3::new(0.01, -0.02, 0.03), Vector3::new(0.02, 0.01, -0.03));
    let contact = Contact { source: 3, target: 3 };
    let at = |pose: &Isometry3<f64>| observe(&surface, &surface, contact, pose);
    let here = at(&pose);
    for k in 0..6 {
        let mut step = Vector6::zeros();
        step[k] = 1e-5;
        // The normal is held: what turns with the pose is not part of the derivative.
        let along = |step: &Vector6<f64>| {
            let moved = step_pose(&pose, step) * surface.patches[3].centre;
            here.normal.dot(&(moved - surface.patches[3].centre))
        };
        let difference = (along(&step) - along(&-step)) / 2e-5;
        // Central differences of a function that is nearly linear: rounding, 1e-16 / 1e-5.
        assert!((difference - here.jacobian[k]).abs() < 1e-9, "{k}: {difference} {}", here.jacobian[k]);
    }
}
