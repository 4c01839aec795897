//! A ring of poses: how much a loop helps, and what it promises.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};
use pose_graph::{Edge, Graph, Relation};
use projective_registration::{ByField, SharedError};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rigid_pose::Uncertain;
use rigid_pose::{pose_difference, step_pose};

const SIGMA: f64 = 2e-3;

fn truth(k: usize) -> Isometry3<f64> {
    let angle = k as f64 * std::f64::consts::TAU / 8.0;
    let start = Isometry3::new(Vector3::new(1.0, 0.0, 0.2), Vector3::zeros()).inverse();
    start * Isometry3::new(Vector3::new(angle.cos(), angle.sin(), 0.2), Vector3::new(0.0, 0.0, angle))
}

/// A ring of eight keyframes with noisy registrations; the last one closes it.
fn ring(seed: u64) -> Graph {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut edge = |a: usize, b: usize| {
        let noise = Vector6::from_fn(|_, _| {
            let n: f64 = StandardNormal.sample(&mut random);
            SIGMA * n
        });
        let pose = step_pose(&(truth(a).inverse() * truth(b)), &noise);
        let random = Uncertain { pose, covariance: Matrix6::identity() * SIGMA * SIGMA };
        Edge { a, b, a_from_b: Relation { random, by_field: ByField::zeros() }, alike: 1.0 }
    };
    let mut graph = Graph::at(truth(0));
    for k in 1..8 {
        graph.add(k - 1, &edge(k - 1, k).a_from_b);
    }
    let closing = edge(7, 0);
    assert!(graph.fits(&closing));
    graph.take([closing]);
    graph
}

/// Mean normalised squared error of keyframe 4 before and after the adjustment, and mean squared distances.
fn statistics(mut work: impl FnMut(&mut Graph)) -> (f64, f64) {
    let (mut nees, mut square) = (0.0, 0.0);
    let runs = 200;
    for seed in 0..runs {
        let mut graph = ring(seed);
        work(&mut graph);
        let error = pose_difference(graph.poses[4].pose(), &truth(4));
        nees += error.dot(&graph.poses[4].random.covariance.cholesky().unwrap().solve(&error));
        square += error.fixed_rows::<3>(0).norm_squared();
    }
    (nees / runs as f64, square / runs as f64)
}

#[test]
fn closing_a_loop_helps_as_much_as_the_covariance_says() {
    let (chain_nees, chain) = statistics(|_| ());
    let (nees, closed) = statistics(|graph| {
        graph.adjust_if_closed();
    });
    // Mean of 200 chi-squared values of 6: 6 ± 0.25; three of these.
    assert!((5.2..6.8).contains(&chain_nees), "{chain_nees}");
    assert!((5.2..6.8).contains(&nees), "{nees}");
    // Opposite the datum both ways around count the same: half the variance, within the scatter of 200 runs.
    assert!(closed < 0.65 * chain, "{closed} {chain}");
}

#[test]
fn a_keyframe_between_two_can_go_without_a_trace() {
    let mut whole = ring(3);
    let mut thinned = whole.clone();
    let (hub, _) = thinned.remove(6).unwrap();
    assert!(hub == 5 || hub == 7);
    whole.adjust_if_closed();
    thinned.adjust_if_closed();
    // With two neighbours nothing is lost but what the second order of rotations of 2 mrad leaves.
    for (k, l) in [(4, 4), (5, 5), (7, 6)] {
        let gap = pose_difference(whole.poses[k].pose(), thinned.poses[l].pose()).norm();
        assert!(gap < 0.02 * SIGMA, "{gap}");
    }
    assert!(!thinned.joined(0, 3) && thinned.joined(0, 6) && thinned.joined(5, 6));
}

#[test]
fn observations_side_by_side_become_their_mean() {
    let (mut whole, mut thinned) = (ring(3), ring(3));
    for poses in (2..8).rev() {
        thinned.remove(1).unwrap();
        assert_eq!((thinned.poses.len(), thinned.edges.len()), (poses, if poses == 2 { 1 } else { poses }));
    }
    whole.adjust_if_closed();
    thinned.adjust_if_closed();
    // The way around and the closing step count as one; second order of rotations as above, over six keyframes.
    let gap = pose_difference(whole.poses[7].pose(), thinned.poses[1].pose()).norm();
    assert!(gap < 0.1 * SIGMA, "{gap}");
    let deviation = |graph: &Graph| graph.poses.last().unwrap().random.covariance.trace().sqrt() / graph.factor.sqrt();
    assert!((deviation(&thinned) / deviation(&whole) - 1.0).abs() < 0.02);
}

/// Mean normalised squared error of keyframe 4 of rings whose registrations share a field, and mean squared errors before
/// and after the loop is closed.
fn with_field(shared: &SharedError) -> (f64, f64, f64) {
    let sigma = shared.of_field().diagonal().map(f64::sqrt);
    let (mut nees, mut before, mut after, runs) = (0.0, 0.0, 0.0, 200);
    for seed in 0..runs {
        let mut random = Pcg64::seed_from_u64(10_000 + seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let field = sigma.map(|s| s * draw());
        let mut graph = ring(seed);
        graph.set_shared_error(shared);
        let closing = graph.edges.pop().unwrap();
        let mut edges = std::mem::take(&mut graph.edges);
        edges.push(closing);
        for edge in &mut edges {
            edge.a_from_b.by_field = ByField::from_fn(|_, _| draw());
            let error = -edge.a_from_b.by_field * field;
            edge.a_from_b.random.pose = step_pose(edge.a_from_b.pose(), &error);
        }
        graph.poses.truncate(1);
        for edge in &edges[..7] {
            graph.add(edge.a, &edge.a_from_b);
        }
        before += pose_difference(graph.poses[4].pose(), &truth(4)).norm_squared();
        if !graph.offer(&edges[7]) {
            continue;
        }
        graph.adjust_if_closed();
        let error = pose_difference(graph.poses[4].pose(), &truth(4));
        after += error.norm_squared();
        let covariance = graph.poses[4].total(&graph.covariance).covariance;
        nees += error.dot(&covariance.cholesky().unwrap().solve(&error));
    }
    (nees / runs as f64, before, after)
}

#[test]
fn a_loop_tells_the_field_that_its_registrations_share() {
    let (mean, before, after) = with_field(&SharedError::known(&[5e-3, 2e-3, 1e-3]));
    // 6 ± 0.25; the variance factor, 1 or more, enlarges covariances by chance.
    assert!((4.5..7.0).contains(&mean), "{mean}");
    assert!(after < 0.6 * before, "{after} {before}");
}

#[test]
fn a_loop_promises_nothing_of_what_differs_from_place_to_place() {
    let (mean, _, _) = with_field(&SharedError::differing(&[5e-3, 2e-3, 1e-3]));
    // At most 6 ± 0.25; less, since the variance factor counts the field's part of the misclosure once more.
    assert!((2.5..7.0).contains(&mean), "{mean}");
}

#[test]
fn a_wrong_registration_does_not_fit() {
    let mut graph = ring(5);
    let mut wrong = graph.edges.pop().unwrap();
    wrong.a_from_b.random.pose = step_pose(wrong.a_from_b.pose(), &Vector6::repeat(0.1));
    assert!(!graph.fits(&wrong));
}
