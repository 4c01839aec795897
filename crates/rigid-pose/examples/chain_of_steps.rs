//! Twenty steps of a walk with a standard deviation each: how well the end is known.

#![allow(clippy::print_stdout)]

use rigid_pose::Uncertain;
use rigid_pose::nalgebra::{Isometry3, Matrix6, Vector3};

fn main() {
    let pose = Isometry3::new(Vector3::new(0.5, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.1));
    // 2 mm and 1 mrad a step.
    let mut covariance = Matrix6::identity() * 1e-6;
    covariance.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(4e-6);
    let step = Uncertain { pose, covariance };
    let mut way = Uncertain::exact(Isometry3::identity());
    for count in 1..=20 {
        way = way.then(&step);
        let position = way.pose.translation.vector;
        let sigma_m = way.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
        println!("{count:2} steps: at {:6.3}, {:6.3} m, known to {:.1} mm", position.x, position.y, 1e3 * sigma_m);
    }
}
