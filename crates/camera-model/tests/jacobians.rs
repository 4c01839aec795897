//! Every derivative against central differences.

use crate::common::{object_point, pixels, poses};
use camera_model::{Camera, LensDistortion, Observation, step_pose};
use nalgebra::{Isometry3, Matrix2, Point3, Vector2, Vector3};
use proptest::prelude::*;

fn vector(observation: &Observation) -> Vector3<f64> {
    Vector3::new(observation.image_mm[0], observation.image_mm[1], observation.range_m)
}

/// Central difference; its error is of order step^2, that of rounding 1e-16 / step.
fn difference(step: f64, mut at: impl FnMut(f64) -> Vector3<f64>) -> Vector3<f64> {
    (at(step) - at(-step)) / (2.0 * step)
}

/// With steps of 1e-5 of what is varied, truncation is 1e-10 and rounding 1e-11 of the scale; 1e-6 leaves room for the
/// cubic growth of short ranges and strong lenses, and still sees any wrong term.
fn require_close(found: Vector3<f64>, expected: Vector3<f64>, scale: f64, what: &str) {
    assert!((found - expected).norm() < 1e-6 * scale, "{what}: {found:?} instead of {expected:?}");
}

struct Case {
    camera: Camera,
    pose: Isometry3<f64>,
    point: Point3<f64>,
}

impl Case {
    fn observe(&self) -> Vector3<f64> {
        vector(&self.camera.observe(&self.pose, &self.point).unwrap())
    }

    fn with_camera(&self, change: impl Fn(&mut Camera)) -> Vector3<f64> {
        let mut camera = self.camera;
        change(&mut camera);
        Case { camera, pose: self.pose, point: self.point }.observe()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn observation((camera, pixel, range) in pixels(), pose in poses()) {
        let point = object_point(&camera, &pose, pixel, range);
        let case = Case { camera, pose, point };
        let (observation, jacobians) = camera.observe_with_jacobians(&pose, &point).unwrap();
        prop_assert_eq!(vector(&observation), case.observe());
        let c = camera.interior.principal_distance_mm;
        let scale_point = 1.0 + 10.0 * c / range;

        for i in 0..3 {
            let moved = difference(1e-5 * range, |h| {
                let mut point = point;
                point[i] += h;
                Case { camera, pose, point }.observe()
            });
            require_close(jacobians.point.column(i).into(), moved, scale_point, "point");
        }
        for i in 0..6 {
            let size = if i < 3 { 1e-5 * range } else { 1e-5 };
            let moved = difference(size, |h| {
                let mut step = [0.0; 6];
                step[i] = h;
                Case { camera, pose: step_pose(&pose, &step), point }.observe()
            });
            let scale = if i < 3 { scale_point } else { 10.0 * (c + range) };
            require_close(jacobians.pose.column(i).into(), moved, scale, "pose");
        }
        let xp = difference(1e-5 * c, |h| case.with_camera(|camera| camera.interior.principal_point_mm[0] += h));
        let yp = difference(1e-5 * c, |h| case.with_camera(|camera| camera.interior.principal_point_mm[1] += h));
        let distance = difference(1e-5 * c, |h| case.with_camera(|camera| camera.interior.principal_distance_mm += h));
        require_close(jacobians.interior.column(0).into(), xp, 1.0, "xp");
        require_close(jacobians.interior.column(1).into(), yp, 1.0, "yp");
        require_close(jacobians.interior.column(2).into(), distance, 10.0, "c");
        for i in 0..7 {
            // A unit of each coefficient that moves the corner of the image by its own distance.
            let corner = camera.format.image_from_pixel([-0.5, -0.5]);
            let corner = corner[0].hypot(corner[1]);
            let unit = [corner.powi(-2), corner.powi(-4), corner.powi(-6), corner.recip(), corner.recip(), 1.0, 1.0][i];
            let moved = difference(1e-5, |h| {
                case.with_camera(|camera| {
                    let mut coefficients = camera.lens.coefficients();
                    coefficients[i] += h * unit;
                    camera.lens = LensDistortion::from_coefficients(coefficients);
                })
            });
            let column: Vector3<f64> = jacobians.lens.column(i).into();
            require_close(column * unit, moved, 10.0 * corner, LensDistortion::NAMES[i]);
        }
    }

    #[test]
    fn lens_correction((camera, pixel, _) in pixels()) {
        let observed = camera.format.image_from_pixel(pixel);
        let interior = camera.interior;
        let step = 1e-5 * interior.principal_distance_mm;
        let at = |x: f64, y: f64| -> Vector2<f64> {
            camera.lens.correction(&interior, [observed[0] + x, observed[1] + y]).into()
        };
        let slope = Matrix2::from_columns(&[
            (at(step, 0.0) - at(-step, 0.0)) / (2.0 * step),
            (at(0.0, step) - at(0.0, -step)) / (2.0 * step),
        ]);
        let found = camera.lens.correction_slope(&interior, observed);
        // Slopes are below 1; see `require_close`.
        prop_assert!((found - slope).norm() < 1e-8, "{found} {slope}");
        // Linear in the coefficients: the design matrix gives the correction itself, to rounding.
        let design = LensDistortion::correction_design(&interior, observed);
        let linear = design * nalgebra::SVector::<f64, 7>::from(camera.lens.coefficients());
        prop_assert!((linear - at(0.0, 0.0)).norm() < 1e-14 * interior.principal_distance_mm);
    }
}

#[test]
fn steps_add_in_world_and_camera_axes() {
    let pose = camera_model::pose_from_euler(Vector3::new(1.0, 2.0, 3.0), [0.3, -1.2, 2.0]);
    let moved = step_pose(&pose, &[0.1, 0.0, 0.0, 0.0, 0.0, 0.2]);
    assert!((moved.translation.vector - Vector3::new(1.1, 2.0, 3.0)).norm() < 1e-15);
    let turned = pose.rotation.inverse() * moved.rotation;
    // 0.2 rad about the camera's own z.
    assert!((turned.scaled_axis() - Vector3::new(0.0, 0.0, 0.2)).norm() < 1e-15);
}
