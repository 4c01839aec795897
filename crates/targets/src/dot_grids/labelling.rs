//! How a lattice may lie on the board.
//!
//! Two lattices of the plane differ by an integer matrix of determinant ±1 and a shift. In perspective the nearest dots need not be
//! those of a row and a column, so all matrices of small elements are tried; a labelling must bring every dot that was seen onto
//! the board, and the larger dot, if there is one, to the origin. A picture of the front has determinant +1.

use std::collections::{BTreeMap, BTreeSet};

use crate::grid::lattice::Node;

/// Largest element of the matrices: the shortest steps of a lattice seen at up to 75° are at most that many steps of the board.
const LARGEST_ELEMENT: i32 = 2;

/// A map of the lattice onto the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Labelling {
    matrix: [[i32; 2]; 2],
    shift: Node,
}

impl Labelling {
    pub(crate) fn apply(&self, [a, b]: Node) -> Node {
        let [[m11, m12], [m21, m22]] = self.matrix;
        [m11 * a + m12 * b + self.shift[0], m21 * a + m22 * b + self.shift[1]]
    }
}

/// All labellings of determinant `determinant` of a lattice whose nodes are given with whether their dot is the larger one.
/// `origin`: the board's node with the larger dot, if it has one.
pub(crate) fn labellings(
    seen: &BTreeMap<Node, bool>,
    board: &BTreeMap<Node, [usize; 2]>,
    origin: Option<Node>,
    determinant: i32,
) -> Vec<Labelling> {
    let (Some(on_board), true) = (bounds(board.keys()), seen.len() <= board.len()) else { return Vec::new() };
    let mut found = Vec::new();
    for matrix in matrices(determinant) {
        let turned = Labelling { matrix, shift: [0, 0] };
        let turned: BTreeMap<Node, bool> = seen.iter().map(|(node, larger)| (turned.apply(*node), *larger)).collect();
        let Some(bounds) = bounds(turned.keys()) else { continue };
        for shift_a in on_board[0][0] - bounds[0][0]..=on_board[1][0] - bounds[1][0] {
            for shift_b in on_board[0][1] - bounds[0][1]..=on_board[1][1] - bounds[1][1] {
                let fits = |(node, larger): (&Node, &bool)| {
                    let place = [node[0] + shift_a, node[1] + shift_b];
                    board.contains_key(&place) && origin.is_none_or(|origin| *larger == (place == origin))
                };
                if turned.iter().all(fits) {
                    found.push(Labelling { matrix, shift: [shift_a, shift_b] });
                }
            }
        }
    }
    found
}

/// Whether all labellings are turns of the board into itself of the first, which is what a picture of all of it cannot tell apart.
pub(crate) fn are_turns(
    labellings: &[Labelling],
    seen: &BTreeMap<Node, bool>,
    board: &BTreeMap<Node, [usize; 2]>,
    origin: Option<Node>,
) -> bool {
    let whole = board.keys().map(|node| (*node, Some(*node) == origin)).collect();
    let turns = self::labellings(&whole, board, origin, 1);
    let labels = |labelling: &Labelling| -> Vec<Node> { seen.keys().map(|node| labelling.apply(*node)).collect() };
    let Some(first) = labellings.first().map(labels) else { return false };
    let turned = turns.iter().map(|turn| first.iter().map(|node| turn.apply(*node)).collect());
    let turned: BTreeSet<Vec<Node>> = turned.collect();
    labellings.iter().all(|labelling| turned.contains(&labels(labelling)))
}

fn matrices(determinant: i32) -> impl Iterator<Item = [[i32; 2]; 2]> {
    let range = || -LARGEST_ELEMENT..=LARGEST_ELEMENT;
    let rows = move || range().flat_map(move |a| range().map(move |b| [a, b]));
    let all = rows().flat_map(move |first| rows().map(move |second| [first, second]));
    all.filter(move |[[a, b], [c, d]]| a * d - b * c == determinant)
}

/// Least and largest of both coordinates.
pub(crate) fn bounds<'a>(mut nodes: impl Iterator<Item = &'a Node>) -> Option<[Node; 2]> {
    let first = *nodes.next()?;
    Some(nodes.fold([first, first], |[low, high], node| {
        [[low[0].min(node[0]), low[1].min(node[1])], [high[0].max(node[0]), high[1].max(node[1])]]
    }))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::dot_grids::CircleGrid;

    fn count(grid: &CircleGrid, keep: impl Fn([usize; 2]) -> bool, determinant: i32) -> (usize, bool) {
        let board = grid.lattice();
        let origin = grid.origin_dot().map(|_| [0, 0]);
        // Seen in a basis that is not the board's.
        let place = |[a, b]: Node| [a + b + 3, b - 7];
        let seen: BTreeMap<Node, bool> =
            board.iter().filter(|(_, node)| keep(**node)).map(|(n, _)| (place(*n), Some(*n) == origin)).collect();
        let found = labellings(&seen, &board, origin, determinant);
        for labelling in &found {
            assert!(seen.keys().all(|node| board.contains_key(&labelling.apply(*node))));
        }
        (found.len(), are_turns(&found, &seen, &board, origin))
    }

    #[test]
    fn whole_grids_have_their_symmetry_and_no_mirror_image() {
        let all = |_: [usize; 2]| true;
        assert_eq!(count(&CircleGrid::symmetric(5, 5, 1.0).unwrap(), all, 1), (4, true));
        assert_eq!(count(&CircleGrid::symmetric(5, 4, 1.0).unwrap(), all, 1), (2, true));
        let marked = CircleGrid::symmetric(5, 5, 1.0).unwrap().with_origin_dot(2.0).unwrap();
        assert_eq!(count(&marked, all, 1), (1, true));
        assert_eq!(count(&CircleGrid::asymmetric(4, 11, 1.0).unwrap(), all, 1), (1, true));
        assert_eq!(count(&CircleGrid::asymmetric(4, 10, 1.0).unwrap(), all, 1), (2, true));
        let marked = CircleGrid::symmetric(6, 4, 1.0).unwrap().with_origin_dot(2.0).unwrap();
        assert_eq!(count(&marked, all, -1).0, 0);
    }

    #[test]
    fn parts_fit_where_the_size_leaves_them_room() {
        let grid = CircleGrid::symmetric(6, 5, 1.0).unwrap();
        assert_eq!(count(&grid, |node| node != [2, 3] && node != [0, 0], 1), (2, true));
        assert!(!count(&grid, |[i, _]| i < 5, 1).1);
        let marked = grid.with_origin_dot(2.0).unwrap();
        assert_eq!(count(&marked, |[i, _]| i < 5, 1), (1, true));
    }
}
