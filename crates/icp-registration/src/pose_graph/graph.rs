//! Poses of the keyframes and the registrations between them.
//!
//! Each registration is an observed relative pose with its random covariance and its derivative by the field of the
//! sensor's shared error. A chain needs no adjustment; where a registration closes a loop, all poses are adjusted.

use nalgebra::Isometry3;

use super::relation::Relation;
use crate::organised::{Field, FieldMatrix, SharedError};

/// Squared distance (six components) that one in a thousand of right registrations exceeds.
const LARGEST_SQUARE: f64 = 22.46;

/// Whether a squared Mahalanobis distance (six components) is that of a right registration, at the 99.9 % level.
pub(crate) fn is_likely(square: f64) -> bool {
    square < LARGEST_SQUARE
}

/// An observed relative pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    pub(crate) a: usize,
    pub(crate) b: usize,
    pub(crate) a_from_b: Relation,
    /// What its covariance is multiplied by, since others share a part of its errors.
    pub(crate) alike: f64,
}

/// Keyframes and what was observed between them.
#[derive(Debug, Clone)]
pub(crate) struct Graph {
    /// World from keyframe.
    pub(crate) poses: Vec<Relation>,
    pub(crate) edges: Vec<Edge>,
    /// The sensor's shared error before any loop.
    pub(crate) shared: SharedError,
    /// The field that is assumed, as closed loops tell it, and its covariance.
    pub(crate) field: Field,
    pub(crate) covariance: FieldMatrix,
    /// By how much observations scatter more than their covariances say, as closed loops tell it; 1 or more.
    pub(crate) factor: f64,
    /// Whether any loop has been closed.
    pub(crate) closed: bool,
    /// Whether there are observations that the poses do not know of yet.
    open: bool,
}

impl Default for Graph {
    fn default() -> Self {
        Self {
            poses: Vec::new(),
            edges: Vec::new(),
            shared: SharedError::none(),
            field: Field::zeros(),
            covariance: FieldMatrix::zeros(),
            factor: 1.0,
            closed: false,
            open: false,
        }
    }
}

impl Graph {
    /// Of one pose, which is held.
    #[cfg_attr(not(feature = "multiview"), allow(dead_code))]
    pub(crate) fn at(datum: Isometry3<f64>) -> Self {
        Self { poses: vec![Relation::exact(datum)], ..Self::default() }
    }

    pub(crate) fn relative(&self, a: usize, b: usize) -> Isometry3<f64> {
        self.poses[a].pose().inverse() * self.poses[b].pose()
    }

    pub(crate) fn joined(&self, a: usize, b: usize) -> bool {
        self.edges.iter().any(|e| (e.a, e.b) == (a, b) || (e.a, e.b) == (b, a))
    }

    /// Sets what is known of the shared error before any loop.
    pub(crate) fn set_shared_error(&mut self, shared: &SharedError) {
        self.shared = *shared;
        if !self.closed {
            self.covariance = shared.of_field();
        }
    }

    /// Adds a pose that is measured from another one, and the observation; returns its index.
    pub(crate) fn add(&mut self, from: usize, from_from_new: &Relation) -> usize {
        let b = self.poses.len();
        self.poses.push(self.from(from, from_from_new));
        self.edges.push(Edge { a: from, b, a_from_b: *from_from_new, alike: 1.0 });
        b
    }

    /// A pose that is measured from another one.
    pub(crate) fn from(&self, from: usize, from_from_new: &Relation) -> Relation {
        self.poses[from].then(&self.weighed(from_from_new, 1.0))
    }

    /// An observation with all random errors that it has, as loops tell them.
    pub(crate) fn weighed(&self, observation: &Relation, alike: f64) -> Relation {
        let mut weighed = *observation;
        weighed.random.covariance *= self.factor * alike;
        weighed
    }

    /// Whether an observation fits what is known already, at the 99.9 % level.
    pub(crate) fn fits(&self, edge: &Edge) -> bool {
        // The random errors of the two poses have most of their past in common, so their sum is a generous bound.
        let mut predicted = self.poses[edge.a].inverse().then(&self.poses[edge.b]);
        predicted.by_field -= edge.a_from_b.by_field;
        let predicted = predicted.total(&self.covariance);
        let square = predicted.mahalanobis_squared(&self.weighed(&edge.a_from_b, edge.alike).random);
        square.is_some_and(is_likely)
    }

    /// Takes an observation that fits; says whether it did.
    pub(crate) fn offer(&mut self, edge: &Edge) -> bool {
        let fits = self.fits(edge);
        if fits {
            self.take([*edge]);
        }
        fits
    }

    /// Takes observations that fit.
    pub(crate) fn take(&mut self, edges: impl IntoIterator<Item = Edge>) {
        let before = self.edges.len();
        self.edges.extend(edges);
        self.open |= self.edges.len() > before;
    }

    /// Adjusts all poses where observations beyond a chain have come in since the last time; what the assumed field has
    /// changed by.
    pub(crate) fn adjust_if_closed(&mut self) -> Field {
        let before = self.field;
        if std::mem::take(&mut self.open) {
            self.closed = true;
            self.adjust();
        }
        self.field - before
    }

    /// Takes keyframe `k` (not the first) out. What joined its neighbours through it joins them to the one that was
    /// best determined from it; returns that one and its pose in the frame of `k`, numbered as before.
    pub(crate) fn remove(&mut self, k: usize) -> Option<(usize, Relation)> {
        let from_k =
            |e: &Edge| if e.a == k { (e.b, e.a_from_b, e.alike) } else { (e.a, e.a_from_b.inverse(), e.alike) };
        let mut joined: Vec<(usize, Relation, f64)> =
            self.edges.iter().filter(|e| e.a == k || e.b == k).map(from_k).collect();
        joined.sort_by(|x, y| x.1.random.covariance.trace().total_cmp(&y.1.random.covariance.trace()));
        let (hub, k_from_hub, _) = *joined.first()?;
        self.edges.retain(|e| e.a != k && e.b != k);
        for (other, k_from_other, alike) in joined.iter().skip(1) {
            if *other != hub {
                let a_from_b = k_from_hub.inverse().then(k_from_other);
                self.edges.push(Edge { a: hub, b: *other, a_from_b, alike: *alike });
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

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use rigid_pose::Uncertain;
    use super::*;
    use crate::organised::ByField;
    use rigid_pose::{pose_difference, step_pose};
    use nalgebra::{Matrix6, Vector3, Vector6};
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
            let random = Uncertain { pose, covariance: Matrix6::identity() * SIGMA * SIGMA };
            Edge { a, b, a_from_b: Relation { random, by_field: ByField::zeros() }, alike: 1.0 }
        };
        let mut graph = Graph::at(truth(0));
        for k in 1..8 {
            graph.add(k - 1, &edge(k - 1, k).a_from_b);
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
            let error = pose_difference(graph.poses[4].pose(), &truth(4));
            nees += error.dot(&graph.poses[4].random.covariance.cholesky().unwrap().solve(&error));
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
            let gap = pose_difference(whole.poses[k].pose(), thinned.poses[l].pose()).norm();
            assert!(gap < 0.02 * SIGMA, "{gap}");
        }
        assert!(!thinned.joined(0, 3) && thinned.joined(0, 6) && thinned.joined(5, 6));
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
}
