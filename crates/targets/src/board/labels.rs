//! Which node of the board each node of a lattice is.

use super::assembly::Assembly;
use super::checkerboard::Checkerboard;
use super::sides::{OUTWARD, Side};
use crate::grid::lattice::Node;

/// One way to lay a lattice on a board: turned by quarters, then shifted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Labeling {
    turn: u8,
    low: Node,
    /// Columns and rows of the lattice.
    size: [i32; 2],
    shift: [i32; 2],
}

impl Labeling {
    /// Column and row on the board of a node of the lattice; beyond the board where the lattice is.
    pub(crate) fn of(&self, node: Node) -> Node {
        let [a, b] = [node[0] - self.low[0], node[1] - self.low[1]];
        let [last_a, last_b] = [self.size[0] - 1, self.size[1] - 1];
        let [i, j] = match self.turn {
            0 => [a, b],
            1 => [b, last_a - a],
            2 => [last_a - a, last_b - b],
            _ => [last_b - b, a],
        };
        [i + self.shift[0], j + self.shift[1]]
    }

    /// The node of the lattice at a column and row of the board; the inverse of [`Self::of`].
    pub(crate) fn node_at(&self, label: Node) -> Node {
        let [i, j] = [label[0] - self.shift[0], label[1] - self.shift[1]];
        let [last_a, last_b] = [self.size[0] - 1, self.size[1] - 1];
        let [a, b] = match self.turn {
            0 => [i, j],
            1 => [last_a - j, i],
            2 => [last_a - i, last_b - j],
            _ => [j, last_b - i],
        };
        [a + self.low[0], b + self.low[1]]
    }
}

/// All ways to lay a lattice on a board that its size, its sides and, where they matter, the colours of its fields allow.
pub(crate) fn labelings(assembly: &Assembly, sides: [Side; 4], board: &Checkerboard) -> Vec<Labeling> {
    let Some([low, high]) = assembly.lattice.bounds() else { return Vec::new() };
    let size = [high[0] - low[0] + 1, high[1] - low[1] + 1];
    let board_size = [board.columns() as i32, board.rows() as i32];
    let mut found = Vec::new();
    for turn in 0..4_u8 {
        let turned = if turn % 2 == 0 { size } else { [size[1], size[0]] };
        for i in 0..=board_size[0] - turned[0] {
            for j in 0..=board_size[1] - turned[1] {
                let labeling = Labeling { turn, low, size, shift: [i, j] };
                let fits =
                    colours_fit(&labeling, assembly, board) && sides_fit(&labeling, [low, high], sides, board_size);
                found.extend(fits.then_some(labeling));
            }
        }
    }
    found
}

/// Whether the field beyond node (0, 0) would be dark.
fn colours_fit(labeling: &Labeling, assembly: &Assembly, board: &Checkerboard) -> bool {
    if !board.colours_matter() {
        return true;
    }
    let [i, j] = labeling.of(labeling.low);
    // The field towards larger columns and rows has the colour of the one opposite: dark at node (0, 0).
    let expected = if (i + j) % 2 == 0 { -1.0 } else { 1.0 };
    // A quarter turn makes the field between two directions its neighbour.
    let turned = if labeling.turn.is_multiple_of(2) { 1.0 } else { -1.0 };
    assembly.sign_at(labeling.low) * turned * expected > 0.0
}

/// Whether the sides where the board ends are sides of it, and those where it goes on are not.
fn sides_fit(labeling: &Labeling, [low, high]: [Node; 2], sides: [Side; 4], board_size: [i32; 2]) -> bool {
    OUTWARD.iter().zip(sides).all(|(outward, side)| {
        let start = if outward[0] + outward[1] < 0 { low } else { high };
        let [i, j] = labeling.of([start[0] + outward[0], start[1] + outward[1]]);
        let on_board = (0..board_size[0]).contains(&i) && (0..board_size[1]).contains(&j);
        match side {
            Side::Ends => !on_board,
            Side::GoesOn => on_board,
            Side::Unknown => true,
        }
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::grid::lattice::Lattice;

    fn assembly(columns: i32, rows: i32, sign: f64) -> Assembly {
        let mut lattice = Lattice::default();
        for i in 0..columns {
            for j in 0..rows {
                lattice.nodes.insert([i - 2, j + 1], 0);
            }
        }
        Assembly { lattice, sign }
    }

    const OPEN: [Side; 4] = [Side::Unknown; 4];

    fn count(seen: [i32; 2], sides: [Side; 4], board: [usize; 2]) -> usize {
        let board = Checkerboard::new(board[0], board[1], 1.0).unwrap();
        let counts = [1.0, -1.0].map(|sign| labelings(&assembly(seen[0], seen[1], sign), sides, &board).len());
        assert!(!board.colours_matter() || seen == [3, 3] || counts[0] == counts[1], "{counts:?}");
        counts[0]
    }

    #[test]
    fn a_whole_board_has_as_many_labelings_as_symmetries() {
        for (size, symmetry) in [([9, 6], 1), ([6, 4], 2), ([7, 5], 2), ([7, 7], 2), ([6, 6], 4)] {
            let board = Checkerboard::new(size[0], size[1], 1.0).unwrap();
            assert_eq!(board.symmetry(), symmetry);
            let seen = size.map(|side| i32::try_from(side).unwrap());
            assert_eq!(count(seen, OPEN, size), symmetry, "{size:?}");
            assert_eq!(count([seen[1], seen[0]], OPEN, size), symmetry, "{size:?}");
        }
    }

    #[test]
    fn sides_settle_parts() {
        let ends = |low_u, low_v, high_u, high_v| {
            [low_u, low_v, high_u, high_v].map(|ends: bool| if ends { Side::Ends } else { Side::Unknown })
        };
        // Five of nine columns in five places, or by a quarter turn five of six rows in eight; both ways round, of which the
        // colours leave a half.
        assert_eq!(count([5, 6], OPEN, [9, 6]), 13);
        assert_eq!(count([5, 6], ends(true, false, false, false), [9, 6]), 1 + 4);
        assert_eq!(count([5, 6], ends(true, true, false, true), [9, 6]), 1);
        assert_eq!(count([5, 6], ends(true, false, true, false), [9, 6]), 0);
        assert_eq!(count([5, 4], ends(true, true, false, false), [9, 6]), 2);
        assert_eq!(count([5, 4], ends(true, true, false, false), [6, 4]), 2);
        assert_eq!(count([10, 6], OPEN, [9, 6]), 0);
        assert_eq!(count([9, 6], [Side::GoesOn, Side::Unknown, Side::Unknown, Side::Unknown], [9, 6]), 0);
    }

    #[test]
    fn labels_go_back_to_nodes() {
        let seen = assembly(4, 3, 1.0);
        for labeling in labelings(&seen, OPEN, &Checkerboard::new(6, 6, 1.0).unwrap()) {
            for node in seen.lattice.nodes.keys() {
                let label = labeling.of(*node);
                assert!((0..6).contains(&label[0]) && (0..6).contains(&label[1]));
                assert_eq!(labeling.node_at(label), *node);
            }
        }
    }
}
