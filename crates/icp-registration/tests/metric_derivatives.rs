//! Derivatives of every metric against differences, seen by a minimiser.

use crate::common::{Pinhole, Scene as Room, cloud, disturbance, look_at};
use icp_registration::parts::{
    Coloured, ErrorMetric, GaussNewton, Minimiser, NearestPoint, PlaneToPlane, PointToPlane, PointToPoint,
    SymmetricPlanes,
};
use icp_registration::{IcpTarget, Registration, System};
use nalgebra::{Matrix6, Vector6};

/// Compares the right-hand side with half the difference quotient of the sum of squares; the first `unknowns` of it.
struct Checked {
    unknowns: usize,
}

impl Minimiser for Checked {
    fn step(&self, system: &System<'_>, free: &Matrix6<f64>) -> Result<Vector6<f64>, icp_registration::Error> {
        let weights = system.all_weights();
        let g = system.normal_equations().gradient;
        let h = 1e-6;
        // Central differences: rounding of the sum of squares over the step.
        let rounding = 1e-15 * system.squares_after(&Vector6::zeros(), &weights) / h;
        for k in 0..self.unknowns {
            let mut motion = Vector6::zeros();
            motion[k] = h;
            let quotient =
                (system.squares_after(&motion, &weights) - system.squares_after(&-motion, &weights)) / (4.0 * h);
            assert!((quotient - g[k]).abs() < 1e-5 * g.norm() + 100.0 * rounding, "{k}: {quotient} {}", g[k]);
        }
        GaussNewton.step(system, free)
    }
}

#[test]
fn derivatives_agree_with_differences() {
    let (a, b) = (look_at([-1.5, -1.0, 1.4], [2.0, 0.8, 0.8]), look_at([-1.2, -1.1, 1.3], [1.8, 1.1, 0.85]));
    let (room, camera) = (Room::furnished(), Pinhole { width: 44, height: 36, focal_px: 38.0 });
    let shaded = |mut cloud: point_cloud::Cloud, pose: &nalgebra::Isometry3<f64>| {
        let shade = |p: &nalgebra::Point3<f64>| (3.0 * (pose * p).x).sin() * 50.0;
        cloud.intensity = Some(cloud.points.iter().map(shade).collect());
        cloud
    };
    let target = IcpTarget::new(shaded(cloud(&room, &camera, &a, 1.0, 1), &a)).unwrap();
    let source = shaded(cloud(&room, &camera, &b, 1.0, 2), &b);
    let all: [(Box<dyn ErrorMetric>, usize); 5] = [
        (Box::new(PointToPoint), 6),
        (Box::new(PointToPlane), 6),
        (Box::new(SymmetricPlanes), 6),
        // The change of its covariances with the rotation is left out on purpose.
        (Box::new(PlaneToPlane::default()), 3),
        (Box::new(Coloured::new(&source, &target).unwrap()), 6),
    ];
    for (metric, unknowns) in all {
        let minimisation = Box::new(Checked { unknowns });
        let registration = Registration { metric, minimisation, ..Registration::new(NearestPoint::new(&target)) };
        let guess = disturbance(0.05, 2.0, 3) * a.inverse() * b;
        registration.align(&source, &guess).unwrap();
    }
}
