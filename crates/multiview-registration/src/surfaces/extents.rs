//! Where things lie: boxes about them, and which of them lie near each other.

use nalgebra::{Isometry3, Point3, Vector3};

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
        (0..3).map(|k| apart(k).powi(2)).sum::<f64>() <= reach_m.powi(2)
    }

    /// The pairs of boxes that may hold things nearer than this to each other: the smaller index first, ascending.
    pub(crate) fn pairs(all: &[Self], reach_m: f64) -> Vec<(usize, usize)> {
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_unstable_by(|&a, &b| all[a].low.x.total_cmp(&all[b].low.x));
        let mut pairs = Vec::new();
        for (place, &one) in order.iter().enumerate() {
            // All behind begin still farther along the axis; rounding is far less than the reach.
            let end_m = all[one].high.x + 2.0 * reach_m;
            let others = order[place + 1..].iter().take_while(|&&other| all[other].low.x <= end_m);
            let near = others.map(|&other| (one.min(other), one.max(other)));
            pairs.extend(near.filter(|&(first, second)| all[second].meets(&all[first], reach_m)));
        }
        pairs.sort_unstable();
        pairs
    }
}

#[cfg(test)]
#[path = "../../tests/inside/extents.rs"]
mod tests;
