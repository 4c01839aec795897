//! Points that coincide, found without an order of the points.

use std::collections::HashMap;

use nalgebra::Point3;

/// The different places of some points, in the order in which they are first met.
#[derive(Debug)]
pub(crate) struct Places {
    /// First point of each place.
    firsts: Vec<u32>,
    /// The next point at the same place, by point; itself where there is none. Empty where no points coincide.
    next: Vec<u32>,
}

impl Places {
    pub(crate) fn new(points: &[Point3<f64>]) -> Self {
        let mut last = HashMap::with_capacity(points.len());
        let (mut firsts, mut next) = (Vec::with_capacity(points.len()), Vec::new());
        for (k, point) in points.iter().enumerate() {
            // Zero has two signs.
            let place = [point.x, point.y, point.z].map(|c| (c + 0.0).to_bits());
            match last.insert(place, k as u32) {
                None => firsts.push(k as u32),
                Some(before) => {
                    if next.is_empty() {
                        next.extend(0..points.len() as u32);
                    }
                    next[before as usize] = k as u32;
                }
            }
        }
        Self { firsts, next }
    }

    /// The first point of each place.
    pub(crate) fn firsts(&self) -> impl Iterator<Item = usize> + '_ {
        self.firsts.iter().map(|k| *k as usize)
    }

    /// The first point of a place.
    pub(crate) fn first(&self, place: u32) -> usize {
        self.firsts[place as usize] as usize
    }

    /// All points of a place in ascending order.
    pub(crate) fn points(&self, place: u32) -> impl Iterator<Item = usize> + '_ {
        let after = |k: &usize| self.next.get(*k).map(|n| *n as usize).filter(|n| n != k);
        std::iter::successors(Some(self.first(place)), after)
    }
}
