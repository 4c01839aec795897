//! A grid grown from a seed, node by node, each predicted from its neighbours.
//!
//! Perspective and lens change the step from node to node by a few percent only, so the step before tells where the next
//! node lies. What is not predicted within [`REACH`] of a step is not a node, and the caller may refuse points for
//! reasons of the image (colours, edges).

use std::collections::{BTreeMap, VecDeque};

use nalgebra::Vector2;

use super::homography::Homography;
use super::nearest::Places;

/// Column and row of a node, from the seed.
pub(crate) type Node = [i32; 2];

/// How far from its prediction a node may lie, in steps. Two predictions are a step apart: below a half they do not meet.
/// From one step of a tilt of 60° in a wide lens the next differs by up to a fifth.
const REACH: f64 = 0.3;

/// The same where eight nodes about predict it.
const REACH_OF_MANY: f64 = 0.2;

/// The four directions of a grid.
const DIRECTIONS: [Node; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// Nodes of a grid, by column and row from the seed, with the index of the point of each.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Lattice {
    /// The index of the point at each node.
    pub(crate) nodes: BTreeMap<Node, usize>,
}

/// Points that a lattice may be grown over.
pub(crate) struct Candidates<'a> {
    pub(crate) points: &'a [Vector2<f64>],
    pub(crate) places: &'a Places<'a>,
}

impl Lattice {
    /// Grows from a point and its neighbours along columns and rows (indices of points). `accept(from, to, direction)` is
    /// asked before the point `to` becomes the neighbour of `from` in that direction.
    pub(crate) fn grow(
        candidates: &Candidates<'_>,
        [origin, along_u, along_v]: [usize; 3],
        accept: &impl Fn(usize, usize, Node) -> bool,
    ) -> Self {
        let mut lattice = Self::default();
        let mut taken = vec![false; candidates.points.len()];
        for (node, point) in [([0, 0], origin), ([1, 0], along_u), ([0, 1], along_v)] {
            lattice.nodes.insert(node, point);
            taken[point] = true;
        }
        // A node that nothing fits at first may fit once more of its neighbours are known.
        loop {
            let before = lattice.nodes.len();
            lattice.grow_once(candidates, &mut taken, accept);
            if lattice.nodes.len() == before {
                return lattice;
            }
        }
    }

    fn grow_once(
        &mut self,
        candidates: &Candidates<'_>,
        taken: &mut [bool],
        accept: &impl Fn(usize, usize, Node) -> bool,
    ) {
        let mut queue: VecDeque<Node> = self.nodes.keys().copied().collect();
        while let Some(node) = queue.pop_front() {
            for direction in DIRECTIONS {
                let next = [node[0] + direction[0], node[1] + direction[1]];
                let (Some(&from), false) = (self.nodes.get(&node), self.nodes.contains_key(&next)) else { continue };
                let Some(step) = self.step(candidates.points, node, direction) else { continue };
                let near = candidates.places.within(candidates.points[from] + step, REACH * step.norm());
                if let Some(to) = near.into_iter().find(|&to| !taken[to] && accept(from, to, direction)) {
                    taken[to] = true;
                    self.nodes.insert(next, to);
                    queue.push_back(next);
                }
            }
        }
    }

    /// The step from a node in a direction: as the step before it, as those of the rows beside, or as it was one node
    /// earlier beside; their mean.
    fn step(&self, points: &[Vector2<f64>], [i, j]: Node, [di, dj]: Node) -> Option<Vector2<f64>> {
        let at = |i: i32, j: i32| self.nodes.get(&[i, j]).map(|&k| points[k]);
        let between = |from: Node, to: Node| Some(at(to[0], to[1])? - at(from[0], from[1])?);
        let here = between([i - di, j - dj], [i, j]);
        let left = between([i + dj, j + di], [i + dj + di, j + di + dj]);
        let right = between([i - dj, j - di], [i - dj + di, j - di + dj]);
        // Beside it the step is known, and how it differs from ours is known from the step before.
        let before_left = between([i + dj - di, j + di - dj], [i + dj, j + di]);
        let before_right = between([i - dj - di, j - di - dj], [i - dj, j - di]);
        let corrected = |beside: Option<Vector2<f64>>, before: Option<Vector2<f64>>| Some(beside? + here? - before?);
        let best = [corrected(left, before_left), corrected(right, before_right)];
        let plain = [here, left, right];
        mean(best.into_iter().flatten()).or_else(|| mean(plain.into_iter().flatten()))
    }

    /// Adds points at nodes that have none, within `gap` nodes of known ones, where the nodes about predict them: across
    /// what hides a part. `accept(node, point, steps)` is asked before, with the steps along columns and rows there.
    pub(crate) fn bridge(
        &mut self,
        candidates: &Candidates<'_>,
        gap: i32,
        accept: &impl Fn(Node, usize, [Vector2<f64>; 2]) -> bool,
    ) {
        loop {
            let mut taken = vec![false; candidates.points.len()];
            self.nodes.values().for_each(|&point| taken[point] = true);
            let mut found = BTreeMap::new();
            for node in self.empty_nodes(gap) {
                let Some(place) = self.predict(candidates.points, node, gap + 2) else { continue };
                let near = candidates.places.within(place.position, REACH_OF_MANY * place.shorter_step());
                if let Some(point) = near.into_iter().find(|&k| !taken[k] && accept(node, k, place.steps)) {
                    taken[point] = true;
                    found.insert(node, point);
                }
            }
            if found.is_empty() {
                return;
            }
            self.nodes.extend(found);
        }
    }

    /// Nodes without a point within `gap` of the bounds.
    pub(crate) fn empty_nodes(&self, gap: i32) -> Vec<Node> {
        let Some([least, most]) = self.bounds() else { return Vec::new() };
        let columns = least[0] - gap..=most[0] + gap;
        let all = columns.flat_map(|i| (least[1] - gap..=most[1] + gap).map(move |j| [i, j]));
        all.filter(|node| !self.nodes.contains_key(node)).collect()
    }

    /// The homography from columns and rows, counted from `node`, to points: by the nodes within `radius` columns and rows
    /// of it, itself left out. `None` of fewer than eight of them, and where they lie on a line.
    pub(crate) fn map_about(&self, points: &[Vector2<f64>], node: Node, radius: i32) -> Option<Homography> {
        let [low, high] = self.bounds()?;
        let mut pairs = Vec::new();
        for i in low[0].max(node[0] - radius)..=high[0].min(node[0] + radius) {
            for (&[i, j], &k) in self.nodes.range([i, node[1] - radius]..=[i, node[1] + radius]) {
                if [i, j] != node {
                    let offset = Vector2::new(f64::from(i - node[0]), f64::from(j - node[1]));
                    pairs.push((offset, points[k]));
                }
            }
        }
        if pairs.len() < 8 { None } else { Homography::fit(&pairs) }
    }

    /// Where a node lies by [`Self::map_about`].
    pub(crate) fn predict(&self, points: &[Vector2<f64>], node: Node, radius: i32) -> Option<Place> {
        let map = self.map_about(points, node, radius)?;
        let position = map.map(Vector2::zeros())?;
        let half = |x: f64, y: f64| Some((map.map(Vector2::new(x, y))? - map.map(Vector2::new(-x, -y))?) * 2.0);
        Some(Place { position, steps: [half(0.25, 0.0)?, half(0.0, 0.25)?] })
    }

    /// Least and largest column and row; `None` of no nodes.
    pub(crate) fn bounds(&self) -> Option<[Node; 2]> {
        let first = *self.nodes.keys().next()?;
        Some(self.nodes.keys().fold([first, first], |[least, most], node| {
            [[least[0].min(node[0]), least[1].min(node[1])], [most[0].max(node[0]), most[1].max(node[1])]]
        }))
    }

    /// Removes nodes with fewer than `least` neighbours that `is_link(from, to)` says they belong to, until none is left.
    pub(crate) fn retain_linked(&mut self, least: usize, is_link: &impl Fn(usize, usize) -> bool) {
        let mut links: BTreeMap<Node, Vec<Node>> = BTreeMap::new();
        for (&node, &from) in &self.nodes {
            for direction in [[1, 0], [0, 1]] {
                let next = [node[0] + direction[0], node[1] + direction[1]];
                if self.nodes.get(&next).is_some_and(|&to| is_link(from, to)) {
                    links.entry(node).or_default().push(next);
                    links.entry(next).or_default().push(node);
                }
            }
        }
        loop {
            let kept = |node: &Node| self.nodes.contains_key(node);
            let degree = |node: &Node| links.get(node).map_or(0, |links| links.iter().filter(|n| kept(n)).count());
            let loose: Vec<Node> = self.nodes.keys().copied().filter(|node| degree(node) < least).collect();
            if loose.is_empty() {
                return;
            }
            self.nodes.retain(|node, _| !loose.contains(node));
        }
    }

    /// Removes columns and rows at the rim that hold fewer than `least` nodes.
    pub(crate) fn trim(&mut self, least: usize) {
        while let Some([low, high]) = self.bounds() {
            let count = |axis: usize, value: i32| self.nodes.keys().filter(|node| node[axis] == value).count();
            let rims = [(0, low[0]), (0, high[0]), (1, low[1]), (1, high[1])];
            let Some((axis, value)) = rims.into_iter().find(|&(axis, value)| count(axis, value) < least) else {
                return;
            };
            self.nodes.retain(|node, _| node[axis] != value);
        }
    }
}

/// Where a node lies, and how the grid runs there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Place {
    pub(crate) position: Vector2<f64>,
    /// From column to column and from row to row.
    pub(crate) steps: [Vector2<f64>; 2],
}

impl Place {
    /// Length of the shorter of both steps.
    pub(crate) fn shorter_step(&self) -> f64 {
        self.steps[0].norm().min(self.steps[1].norm())
    }
}

fn mean(steps: impl Iterator<Item = Vector2<f64>>) -> Option<Vector2<f64>> {
    let (sum, count) = steps.fold((Vector2::zeros(), 0.0), |(sum, count), step| (sum + step, count + 1.0));
    (count > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// A tilted grid of 9 x 6 nodes through a lens, and points that are none.
    fn points() -> Vec<Vector2<f64>> {
        let nodes = (0..54).map(|k| Vector2::new(f64::from(k % 9), f64::from(k / 9)));
        let seen = nodes.map(|p| {
            let q = Vector2::new(20.0 * p.x + 3.0 * p.y, 18.0 * p.y - 2.0 * p.x) / (1.0 + 0.04 * p.x + 0.03 * p.y);
            q * (1.0 - 1e-6 * (q - Vector2::new(70.0, 40.0)).norm_squared())
        });
        let clutter = (0..30).map(|k| Vector2::new(f64::from(k * 41 % 170), -12.0 - f64::from(k * 17 % 60)));
        seen.chain(clutter).collect()
    }

    #[test]
    fn a_grid_in_perspective_is_grown_whole_and_nothing_else() {
        let points = points();
        let candidates = Candidates { points: &points, places: &Places::new(&points) };
        let lattice = Lattice::grow(&candidates, [20, 21, 29], &|_, to, _| to < 54);
        assert_eq!(lattice.nodes.len(), 54);
        for ([i, j], point) in &lattice.nodes {
            assert_eq!(usize::try_from((j + 2) * 9 + i + 2).unwrap(), *point);
        }
        assert_eq!(lattice.bounds(), Some([[-2, -2], [6, 3]]));
    }

    #[test]
    fn a_gap_is_bridged() {
        let points = points();
        let hidden = |k: usize| k < 54 && k % 9 == 4;
        let candidates = Candidates { points: &points, places: &Places::new(&points) };
        let mut lattice = Lattice::grow(&candidates, [18, 19, 27], &|_, to, _| to < 54 && !hidden(to));
        assert_eq!(lattice.nodes.len(), 24);
        lattice.bridge(&candidates, 2, &|_, point, _| point < 54 && !hidden(point));
        assert_eq!(lattice.nodes.len(), 48);
        assert_eq!(lattice.nodes[&[8, 1]], 35);
    }

    #[test]
    fn loose_nodes_go_and_what_hangs_on_them() {
        let mut lattice = Lattice::default();
        for k in 0..12 {
            lattice.nodes.insert([k % 4, k / 4], k as usize);
        }
        lattice.nodes.insert([4, 0], 12);
        lattice.nodes.insert([5, 0], 13);
        lattice.retain_linked(2, &|_, _| true);
        assert_eq!(lattice.nodes.len(), 12);
        lattice.retain_linked(2, &|_, to| to != 3);
        assert_eq!(lattice.nodes.len(), 11);
        lattice.retain_linked(2, &|from, _| from != 0);
        assert_eq!(lattice.nodes.len(), 10);
    }

    #[test]
    fn thin_rims_are_trimmed() {
        let mut lattice = Lattice::default();
        for k in 0..12 {
            lattice.nodes.insert([k % 4, k / 4], k as usize);
        }
        lattice.nodes.insert([9, 1], 12);
        lattice.trim(2);
        assert_eq!(lattice.nodes.len(), 12);
        lattice.trim(20);
        assert!(lattice.nodes.is_empty() && lattice.bounds().is_none());
    }
}
