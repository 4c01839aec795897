//! Eight steps around a ring, and the registration that closes it: what the loop does to the pose opposite the start.

#![allow(clippy::print_stdout)]

use pose_graph::{Edge, Graph, Relation};
use projective_registration::ByField;
use rigid_pose::Uncertain;
use rigid_pose::nalgebra::{Isometry3, Matrix6, Vector3};

fn main() {
    let turn = std::f64::consts::TAU / 8.0;
    let around = |k: usize| {
        let angle = turn * k as f64;
        Isometry3::new(Vector3::new(angle.cos(), angle.sin(), 0.0), Vector3::new(0.0, 0.0, angle))
    };
    // Each registration is 2 mm off along x; 2 mm and 1 mrad are stated.
    let mut covariance = Matrix6::identity() * 1e-6;
    covariance.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(4e-6);
    let observed = |a: usize, b: usize| {
        let pose = around(a).inverse() * around(b) * Isometry3::translation(2e-3, 0.0, 0.0);
        Relation { random: Uncertain { pose, covariance }, by_field: ByField::zeros() }
    };
    let mut graph = Graph::at(around(0));
    for k in 1..8 {
        graph.add(k - 1, &observed(k - 1, k));
    }
    let say = |when: &str, graph: &Graph| {
        let error = graph.poses[4].pose().translation.vector - around(4).translation.vector;
        let sigma = graph.poses[4].random.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt();
        println!("{when}: {:.1} mm off, {:.1} mm stated", 1e3 * error.norm(), 1e3 * sigma);
    };
    say("before", &graph);
    let closing = Edge { a: 7, b: 0, a_from_b: observed(7, 0), alike: 1.0 };
    println!("fits what is known: {}", graph.offer(&closing));
    graph.adjust_if_closed();
    say("after", &graph);
}
