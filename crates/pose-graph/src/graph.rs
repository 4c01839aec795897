//! Poses of the keyframes and the registrations between them.
//!
//! Each registration is an observed relative pose with its random covariance and its derivative by the field of the
//! sensor's shared error. A chain needs no adjustment; where a registration closes a loop, all poses are adjusted.

use nalgebra::Isometry3;

use super::relation::Relation;
use projective_registration::{Field, FieldMatrix, SharedError};
use statistics::Distribution;

/// Whether a squared Mahalanobis distance (six components) is that of a right registration, at the 99.9 % level.
pub fn is_likely(square: f64) -> bool {
    Distribution::ChiSquared { dof: 6.0 }.survival(square) > 1e-3
}

/// An observed relative pose.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// Index of the one pose.
    pub a: usize,
    /// Index of the other.
    pub b: usize,
    /// The second in the frame of the first, as observed.
    pub a_from_b: Relation,
    /// What its covariance is multiplied by, since others share a part of its errors.
    pub alike: f64,
}

/// Keyframes and what was observed between them.
#[derive(Debug, Clone)]
pub struct Graph {
    /// World from keyframe.
    pub poses: Vec<Relation>,
    /// What was observed between them.
    pub edges: Vec<Edge>,
    /// The sensor's shared error before any loop.
    pub(crate) shared: SharedError,
    /// The field that is assumed, as closed loops tell it, and its covariance.
    pub field: Field,
    /// Covariance of `field`.
    pub covariance: FieldMatrix,
    /// By how much observations scatter more than their covariances say, as closed loops tell it; 1 or more.
    pub factor: f64,
    /// Whether any loop has been closed.
    pub closed: bool,
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
    pub fn at(datum: Isometry3<f64>) -> Self {
        Self { poses: vec![Relation::exact(datum)], ..Self::default() }
    }

    /// `a_from_b` of two poses.
    pub fn relative(&self, a: usize, b: usize) -> Isometry3<f64> {
        self.poses[a].pose().inverse() * self.poses[b].pose()
    }

    /// Whether there is an observation between two poses.
    pub fn joined(&self, a: usize, b: usize) -> bool {
        self.edges.iter().any(|e| (e.a, e.b) == (a, b) || (e.a, e.b) == (b, a))
    }

    /// Sets what is known of the shared error before any loop.
    pub fn set_shared_error(&mut self, shared: &SharedError) {
        self.shared = *shared;
        if !self.closed {
            self.covariance = shared.of_field();
        }
    }

    /// Adds a pose that is measured from another one, and the observation; returns its index.
    pub fn add(&mut self, from: usize, from_from_new: &Relation) -> usize {
        let b = self.poses.len();
        self.poses.push(self.from(from, from_from_new));
        self.edges.push(Edge { a: from, b, a_from_b: *from_from_new, alike: 1.0 });
        b
    }

    /// A pose that is measured from another one.
    pub fn from(&self, from: usize, from_from_new: &Relation) -> Relation {
        self.poses[from].then(&self.weighed(from_from_new, 1.0))
    }

    /// An observation with all random errors that it has, as loops tell them.
    pub(crate) fn weighed(&self, observation: &Relation, alike: f64) -> Relation {
        let mut weighed = *observation;
        weighed.random.covariance *= self.factor * alike;
        weighed
    }

    /// Whether an observation fits what is known already, at the 99.9 % level.
    pub fn fits(&self, edge: &Edge) -> bool {
        // The random errors of the two poses have most of their past in common, so their sum is a generous bound.
        let mut predicted = self.poses[edge.a].inverse().then(&self.poses[edge.b]);
        predicted.by_field -= edge.a_from_b.by_field;
        let predicted = predicted.total(&self.covariance);
        let square = predicted.mahalanobis_squared(&self.weighed(&edge.a_from_b, edge.alike).random);
        square.is_some_and(is_likely)
    }

    /// Takes an observation that fits; says whether it did.
    pub fn offer(&mut self, edge: &Edge) -> bool {
        let fits = self.fits(edge);
        if fits {
            self.take([*edge]);
        }
        fits
    }

    /// Takes observations that fit.
    pub fn take(&mut self, edges: impl IntoIterator<Item = Edge>) {
        let before = self.edges.len();
        self.edges.extend(edges);
        self.open |= self.edges.len() > before;
    }

    /// Adjusts all poses where observations beyond a chain have come in since the last time; what the assumed field has
    /// changed by.
    pub fn adjust_if_closed(&mut self) -> Field {
        let before = self.field;
        if std::mem::take(&mut self.open) {
            self.closed = true;
            self.adjust();
        }
        self.field - before
    }

    /// Adds an observation; where there is one between its poses already, both become their mean: of a path of very many keyframes,
    /// of which some are kept, the observations would grow without end.
    fn bring_in(&mut self, edge: &Edge) {
        let joins = |known: &&mut Edge| [(edge.a, edge.b), (edge.b, edge.a)].contains(&(known.a, known.b));
        let Some(known) = self.edges.iter_mut().find(joins) else { return self.edges.push(*edge) };
        let a_from_b = if known.a == edge.a { edge.a_from_b } else { edge.a_from_b.inverse() };
        let alone = |relation: &Relation, alike: f64| {
            let mut alone = *relation;
            alone.random.covariance *= alike;
            alone
        };
        match alone(&known.a_from_b, known.alike).mean(&alone(&a_from_b, edge.alike)) {
            Some(mean) => (known.a_from_b, known.alike) = (mean, 1.0),
            None => self.edges.push(*edge),
        }
    }

    /// Takes keyframe `k` (not the first) out. What joined its neighbours through it joins them to the one that was
    /// best determined from it; returns that one and its pose in the frame of `k`, numbered as before.
    pub fn remove(&mut self, k: usize) -> Option<(usize, Relation)> {
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
                self.bring_in(&Edge { a: hub, b: *other, a_from_b, alike: *alike });
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
