//! Poses of the keyframes from the registrations between them.
//!
//! Each registration is an observed relative pose with its covariance. A chain needs no adjustment; where a
//! registration closes a loop, all poses are adjusted by least squares (Gauss and Newton, first keyframe held).

use nalgebra::{DMatrix, DVector, Isometry3, Matrix6, Vector6};

use super::motion::{Uncertain, product_jacobians};
use crate::pose::{pose_difference, step_pose, symmetrised};

const MAX_ITERATIONS: usize = 10;
/// Steps (metre, radian) below which the adjustment has converged: far below every standard deviation.
const STEP: f64 = 1e-7;

/// An observed relative pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) a_from_b: Uncertain,
}

/// Keyframes and what was observed between them.
#[derive(Debug, Clone, Default)]
pub(super) struct Graph {
    /// World from keyframe.
    pub(super) poses: Vec<Uncertain>,
    pub(super) edges: Vec<Edge>,
    /// Whether there are observations that the poses do not know of yet.
    open: bool,
}

impl Graph {
    pub(super) fn relative(&self, a: usize, b: usize) -> Isometry3<f64> {
        self.poses[a].pose.inverse() * self.poses[b].pose
    }

    pub(super) fn joined(&self, a: usize, b: usize) -> bool {
        self.edges.iter().any(|e| (e.a, e.b) == (a, b) || (e.a, e.b) == (b, a))
    }

    /// Whether an observation fits what is known already, at the 99.9 % level.
    pub(super) fn fits(&self, edge: &Edge) -> bool {
        // The errors of the two poses have most of their past in common, so their sum is a generous bound.
        let predicted = self.poses[edge.a].inverse().then(&self.poses[edge.b]);
        predicted.mahalanobis_squared(&edge.a_from_b).is_some_and(|m| m < 22.46)
    }

    /// Takes an observation that fits; says whether it did.
    pub(super) fn offer(&mut self, edge: &Edge) -> bool {
        let fits = self.fits(edge);
        if fits {
            self.edges.push(*edge);
            self.open = true;
        }
        fits
    }

    /// Adjusts all poses where observations beyond a chain have come in since the last time.
    pub(super) fn adjust_if_closed(&mut self) {
        if std::mem::take(&mut self.open) {
            self.adjust();
        }
    }

    /// Adjusts all poses; leaves them as they are where the observations do not determine them.
    pub(super) fn adjust(&mut self) {
        let mut poses: Vec<Isometry3<f64>> = self.poses.iter().map(|p| p.pose).collect();
        let mut inverse = None;
        for _ in 0..MAX_ITERATIONS {
            let (matrix, right) = self.normal_equations(&poses);
            let Some(factor) = matrix.cholesky() else { return };
            let step = factor.solve(&right);
            if !step.iter().all(|v| v.is_finite()) {
                return;
            }
            for (k, pose) in poses.iter_mut().enumerate().skip(1) {
                *pose = step_pose(pose, &Vector6::from_fn(|i, _| step[6 * (k - 1) + i]));
            }
            inverse = Some(factor);
            if step.amax() < STEP {
                break;
            }
        }
        let Some(covariance) = inverse.map(|factor| factor.inverse()) else { return };
        let datum = self.poses.first().map_or_else(Matrix6::zeros, |p| p.covariance);
        for (k, (kept, pose)) in self.poses.iter_mut().zip(poses).enumerate() {
            let block = |k: usize| {
                let view = covariance.fixed_view::<6, 6>(6 * (k - 1), 6 * (k - 1));
                symmetrised(&view.into_owned())
            };
            *kept = Uncertain { pose, covariance: if k == 0 { datum } else { block(k) } };
        }
    }

    /// Normal matrix and right-hand side of all poses but the first.
    fn normal_equations(&self, poses: &[Isometry3<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let size = 6 * (poses.len() - 1);
        let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for edge in &self.edges {
            let model = poses[edge.a].inverse() * poses[edge.b];
            let v = pose_difference(&model, &edge.a_from_b.pose);
            let Some(factor) = edge.a_from_b.covariance.cholesky() else { continue };
            let information = factor.inverse();
            let jacobians = [(edge.a, by_first(&poses[edge.a], &model)), (edge.b, by_second(&poses[edge.a]))];
            for (k, jk) in &jacobians {
                if *k == 0 {
                    continue;
                }
                let row = 6 * (k - 1);
                let weighted = jk.transpose() * information;
                let mut part = right.fixed_rows_mut::<6>(row);
                part += weighted * v;
                for (l, jl) in &jacobians {
                    if *l != 0 {
                        let mut block = matrix.fixed_view_mut::<6, 6>(row, 6 * (l - 1));
                        block += weighted * jl;
                    }
                }
            }
        }
        (matrix, right)
    }

    /// Takes keyframe `k` (not the first) out. What joined its neighbours through it joins them to the one that was
    /// best determined from it; returns that one and its pose in the frame of `k`, numbered as before.
    pub(super) fn remove(&mut self, k: usize) -> Option<(usize, Uncertain)> {
        let from_k = |e: &Edge| if e.a == k { (e.b, e.a_from_b) } else { (e.a, e.a_from_b.inverse()) };
        let mut joined: Vec<(usize, Uncertain)> =
            self.edges.iter().filter(|e| e.a == k || e.b == k).map(from_k).collect();
        joined.sort_by(|x, y| x.1.covariance.trace().total_cmp(&y.1.covariance.trace()));
        let (hub, k_from_hub) = *joined.first()?;
        self.edges.retain(|e| e.a != k && e.b != k);
        for (other, k_from_other) in joined.iter().skip(1) {
            if *other != hub {
                let a_from_b = k_from_hub.inverse().then(k_from_other);
                self.edges.push(Edge { a: hub, b: *other, a_from_b });
            }
        }
        self.poses.remove(k);
        for edge in &mut self.edges {
            edge.a -= usize::from(edge.a > k);
            edge.b -= usize::from(edge.b > k);
        }
        Some((hub, k_from_hub))
    }
}

/// Jacobian of `a⁻¹ b` by the tangent of `world_from_a`.
fn by_first(world_from_a: &Isometry3<f64>, model: &Isometry3<f64>) -> Matrix6<f64> {
    let a_from_world = world_from_a.inverse();
    let world_from_b = world_from_a * model;
    let (by_inverse, _) = product_jacobians(&a_from_world, &world_from_b);
    by_inverse * inverse_jacobian(world_from_a)
}

/// Jacobian of `a⁻¹ b` by the tangent of `world_from_b`.
fn by_second(world_from_a: &Isometry3<f64>) -> Matrix6<f64> {
    product_jacobians(&world_from_a.inverse(), &Isometry3::identity()).1
}

/// Jacobian of the tangent of the inverse.
fn inverse_jacobian(a_from_b: &Isometry3<f64>) -> Matrix6<f64> {
    let r = a_from_b.rotation.to_rotation_matrix().into_inner();
    let lever = (r.transpose() * a_from_b.translation.vector).cross_matrix();
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&-r.transpose());
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-lever);
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&-r);
    jacobian
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use nalgebra::Vector3;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

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
            Edge { a, b, a_from_b: Uncertain { pose, covariance: Matrix6::identity() * SIGMA * SIGMA } }
        };
        let mut graph = Graph { poses: vec![Uncertain::exact(truth(0))], edges: Vec::new(), open: false };
        for k in 1..8 {
            let observed = edge(k - 1, k);
            graph.poses.push(graph.poses[k - 1].then(&observed.a_from_b));
            graph.edges.push(observed);
        }
        let closing = edge(7, 0);
        assert!(graph.fits(&closing));
        graph.edges.push(closing);
        graph
    }

    /// Mean normalised squared error of keyframe 4 before and after the adjustment, and mean squared distances.
    fn statistics(mut work: impl FnMut(&mut Graph)) -> (f64, f64) {
        let (mut nees, mut square) = (0.0, 0.0);
        let runs = 200;
        for seed in 0..runs {
            let mut graph = ring(seed);
            work(&mut graph);
            let error = pose_difference(&graph.poses[4].pose, &truth(4));
            nees += error.dot(&graph.poses[4].covariance.cholesky().unwrap().solve(&error));
            square += error.fixed_rows::<3>(0).norm_squared();
        }
        (nees / runs as f64, square / runs as f64)
    }

    #[test]
    fn closing_a_loop_helps_as_much_as_the_covariance_says() {
        let (chain_nees, chain) = statistics(|_| ());
        let (nees, closed) = statistics(Graph::adjust);
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
        whole.adjust();
        thinned.adjust();
        // With two neighbours nothing is lost but what the second order of rotations of 2 mrad leaves.
        for (k, l) in [(4, 4), (5, 5), (7, 6)] {
            let gap = pose_difference(&whole.poses[k].pose, &thinned.poses[l].pose).norm();
            assert!(gap < 0.02 * SIGMA, "{gap}");
        }
        assert!(!thinned.joined(0, 3) && thinned.joined(0, 6) && thinned.joined(5, 6));
    }

    #[test]
    fn jacobians_of_relative_poses_agree_with_differences() {
        let (a, b) = (truth(3) * truth(1), truth(5));
        let model = a.inverse() * b;
        let step = 1e-6;
        for k in 0..6 {
            let e = Vector6::from_fn(|i, _| if i == k { step } else { 0.0 });
            let first = pose_difference(&model, &(step_pose(&a, &e).inverse() * b)) / step;
            let second = pose_difference(&model, &(a.inverse() * step_pose(&b, &e))) / step;
            // One-sided differences of curved rotations at 1e-6.
            assert!((first - by_first(&a, &model).column(k)).norm() < 1e-5);
            assert!((second - by_second(&a).column(k)).norm() < 1e-5);
        }
    }

    #[test]
    fn a_wrong_registration_does_not_fit() {
        let mut graph = ring(5);
        let mut wrong = graph.edges.pop().unwrap();
        wrong.a_from_b.pose = step_pose(&wrong.a_from_b.pose, &Vector6::repeat(0.1));
        assert!(!graph.fits(&wrong));
    }
}
