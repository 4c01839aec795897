//! Where things lie: boxes about them, and which of many lie near each other, without trying all pairs.

use nalgebra::{Isometry3, Point3, Vector3};

/// Boxes in a leaf of the tree.
const LEAF: usize = 8;
/// Share by which a distance may be off by rounding.
const ROUNDING: f64 = 1e-9;

/// An axis-parallel box, metre; of nothing, it lies nowhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Extent {
    /// The box about these points.
    pub(crate) fn of(points: impl Iterator<Item = Point3<f64>>) -> Self {
        let nothing = Self { low: Vector3::repeat(f64::INFINITY), high: Vector3::repeat(f64::NEG_INFINITY) };
        points.fold(nothing, |own, point| Self { low: own.low.inf(&point.coords), high: own.high.sup(&point.coords) })
    }

    /// The box about a ball.
    pub(crate) fn about(centre: &Vector3<f64>, radius_m: f64) -> Self {
        Self { low: centre.add_scalar(-radius_m), high: centre.add_scalar(radius_m) }
    }

    /// The box about the points of a station at a pose.
    pub(crate) fn placed<'a>(points: impl Iterator<Item = &'a Point3<f64>>, pose: &Isometry3<f64>) -> Self {
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        Self::of(points.map(|point| Point3::from(rotation * point.coords + pose.translation.vector)))
    }

    /// The box about both.
    pub(crate) fn joined(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Whether a point may lie nearer than this to something in the box.
    pub(crate) fn is_near(&self, point: &Vector3<f64>, reach_m: f64) -> bool {
        self.meets(&Self { low: *point, high: *point }, reach_m)
    }

    /// Whether something in the one may lie nearer than this to something in the other.
    pub(crate) fn meets(&self, other: &Self, reach_m: f64) -> bool {
        // Nothing lies nowhere.
        if self.low.x > self.high.x || other.low.x > other.high.x {
            return false;
        }
        let apart = |k: usize| (self.low[k] - other.high[k]).max(other.low[k] - self.high[k]).max(0.0);
        let size = |k: usize| self.low[k].abs().max(self.high[k].abs());
        let slack_m = ROUNDING * (reach_m + size(0) + size(1) + size(2));
        let square: f64 = (0..3).map(|k| apart(k).powi(2)).sum();
        square <= (reach_m + slack_m).powi(2)
    }

    fn middle(&self, axis: usize) -> f64 {
        self.low[axis].midpoint(self.high[axis])
    }
}

/// Many boxes, those that lie near each other together.
pub(crate) struct Extents<'a> {
    all: &'a [Extent],
    /// Indices of boxes, those of a node one after the other.
    order: Vec<usize>,
    /// Box about the boxes of a node, which they are in `order`, and its two halves.
    nodes: Vec<(Extent, std::ops::Range<usize>, Option<[usize; 2]>)>,
}

impl<'a> Extents<'a> {
    pub(crate) fn new(all: &'a [Extent]) -> Self {
        let mut this = Self { all, order: (0..all.len()).collect(), nodes: Vec::new() };
        if !all.is_empty() {
            this.divide(0..all.len());
        }
        this
    }

    /// Adds a node and those below it; returns its number.
    fn divide(&mut self, range: std::ops::Range<usize>) -> usize {
        let own = &mut self.order[range.clone()];
        let all = self.all;
        let about = own.iter().map(|&k| all[k]).reduce(|a, b| a.joined(&b)).unwrap_or(all[0]);
        let number = self.nodes.len();
        self.nodes.push((about, range.clone(), None));
        if range.len() > LEAF {
            let axis = (about.high - about.low).imax();
            own.sort_unstable_by(|&a, &b| all[a].middle(axis).total_cmp(&all[b].middle(axis)).then(a.cmp(&b)));
            let middle = range.start.midpoint(range.end);
            let halves = [self.divide(range.start..middle), self.divide(middle..range.end)];
            self.nodes[number].2 = Some(halves);
        }
        number
    }

    /// The boxes that may hold something nearer than this to something in a box, ascending.
    pub(crate) fn near(&self, asked: &Extent, reach_m: f64) -> Vec<usize> {
        let (mut found, mut open) = (Vec::new(), Vec::new());
        open.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(node) = open.pop() {
            let (about, range, halves) = &self.nodes[node];
            if !about.meets(asked, reach_m) {
                continue;
            }
            match halves {
                Some(halves) => open.extend(halves),
                None => found
                    .extend(self.order[range.clone()].iter().copied().filter(|&k| self.all[k].meets(asked, reach_m))),
            }
        }
        found.sort_unstable();
        found
    }

    /// The pairs of boxes that may hold things nearer than this to each other: the smaller index first, ascending.
    pub(crate) fn pairs(&self, reach_m: f64) -> Vec<(usize, usize)> {
        let with = |first: usize| {
            let near = self.near(&self.all[first], reach_m);
            near.into_iter().filter(move |&second| second > first).map(move |second| (first, second))
        };
        (0..self.all.len()).flat_map(with).collect()
    }
}

#[cfg(test)]
#[path = "../../tests/inside/extents.rs"]
mod tests;
