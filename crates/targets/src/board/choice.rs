//! Which lattice is the board.

use std::collections::BTreeSet;

use nalgebra::Vector2;

use super::assembly::Assembly;
use super::checkerboard::Checkerboard;
use super::labels::{Labeling, labelings};
use super::saddles::Level;
use super::sides::sides;
use crate::error::NotFound;
use crate::grid::lattice::Node;

/// Boards with fields smaller than this part of another's do not count beside it, be that of the size asked for or not: a
/// picture of the board on a screen.
const RIVAL: f64 = 0.5;

/// A lattice, and how it may lie on the board.
pub(crate) struct Laid {
    pub(crate) assembly: Assembly,
    /// Where its nodes were seen, and other points.
    pub(crate) points: Vec<Vector2<f64>>,
    labelings: Vec<Labeling>,
}

impl Laid {
    pub(crate) fn new(level: &Level, assembly: Assembly, points: &[Vector2<f64>], board: &Checkerboard) -> Self {
        let sides = sides(level, &assembly, points);
        let labelings = labelings(&assembly, sides, board);
        Self { assembly, points: points.to_vec(), labelings }
    }

    /// How many nodes were seen.
    pub(crate) fn count(&self) -> usize {
        self.assembly.lattice.nodes.len()
    }

    /// The labeling whose node (0, 0) is nearest to the upper left corner of the image.
    pub(crate) fn upper_left(&self) -> Option<Labeling> {
        let from_corner = |labeling: &Labeling| {
            let node = labeling.node_at([0, 0]);
            let known = self.assembly.lattice.nodes.get(&node).map(|&k| self.points[k]);
            let place = known.or_else(|| {
                // By all nodes: the whole board at once.
                self.assembly.lattice.map_about(&self.points, node, i32::MAX / 4)?.map(Vector2::zeros())
            });
            place.map_or(f64::INFINITY, |place| place.norm())
        };
        self.labelings.iter().copied().min_by(|a, b| from_corner(a).total_cmp(&from_corner(b)))
    }

    /// Median distance of neighbours, pixel.
    fn field_px(&self) -> f64 {
        let nodes = &self.assembly.lattice.nodes;
        let beside = |[i, j]: Node| [[i + 1, j], [i, j + 1]].into_iter().filter_map(|next| nodes.get(&next));
        let steps = nodes
            .iter()
            .flat_map(|(&node, &k)| beside(node).map(move |&next| (self.points[next] - self.points[k]).norm()));
        statistics::upper_median(&mut steps.collect::<Vec<f64>>())
    }

    /// Columns and rows, those of the board first where it has more of them.
    fn size(&self, board: &Checkerboard) -> [usize; 2] {
        let Some([low, high]) = self.assembly.lattice.bounds() else { return [0, 0] };
        let size = [0, 1].map(|axis| (high[axis] - low[axis] + 1) as usize);
        let upright = (board.columns() >= board.rows()) == (size[0] >= size[1]);
        if upright { size } else { [size[1], size[0]] }
    }

    fn is_whole(&self, board: &Checkerboard) -> bool {
        self.size(board) == [board.columns(), board.rows()]
    }

    /// In how many places of the board it may lie, turns that look the same counted once.
    fn places(&self, board: &Checkerboard) -> usize {
        self.labelings.len().div_ceil(board.symmetry())
    }

    /// The labels of its nodes, one way round.
    fn labels(&self) -> BTreeSet<Node> {
        let labels = |labeling: &Labeling| self.assembly.lattice.nodes.keys().map(|node| labeling.of(*node)).collect();
        self.labelings.first().map(labels).unwrap_or_default()
    }
}

/// The lattice that is the board, out of those found among `points` saddles, the largest first; or why none is.
pub(crate) fn choose(
    mut laid: Vec<Laid>,
    points: usize,
    needed: usize,
    board: &Checkerboard,
) -> Result<Laid, NotFound> {
    let largest_px = laid.iter().filter(|laid| laid.count() >= needed).map(Laid::field_px).fold(0.0, f64::max);
    let settled =
        |laid: &Laid| laid.places(board) == 1 && laid.count() >= needed && laid.field_px() > RIVAL * largest_px;
    let is_whole = |laid: &Laid| settled(laid) && laid.is_whole(board);
    let any_whole = laid.iter().any(is_whole);
    let is_candidate = |laid: &Laid| if any_whole { is_whole(laid) } else { settled(laid) };
    let by_field = |a: &usize, b: &usize| laid[*a].field_px().total_cmp(&laid[*b].field_px());
    let candidates: Vec<usize> = (0..laid.len()).filter(|&k| is_candidate(&laid[k])).collect();
    let Some(best) = candidates.iter().copied().max_by(by_field) else {
        return Err(reason(&laid, points, needed, board));
    };
    let labels = laid[best].labels();
    let is_rival = |&k: &usize| {
        // Parts of one board, on both sides of what hides the middle, have no node in common.
        k != best && !laid[k].labels().is_disjoint(&labels)
    };
    match candidates.iter().filter(|k| is_rival(k)).count() {
        0 => Ok(laid.swap_remove(best)),
        rivals => Err(NotFound::SeveralBoards { found: rivals + 1 }),
    }
}

/// Why no lattice is the board, by the largest.
fn reason(laid: &[Laid], points: usize, needed: usize, board: &Checkerboard) -> NotFound {
    let largest = laid.first().map_or(0, Laid::count);
    if points < needed {
        return NotFound::TooFewPoints { found: points, needed };
    }
    let Some(first) = laid.first().filter(|_| largest >= needed) else {
        return NotFound::NoGrid { points, largest, needed };
    };
    let (found, board_size) = (first.size(board), [board.columns(), board.rows()]);
    match first.places(board) {
        0 => NotFound::WrongSize { found, board: board_size },
        places => NotFound::PartAmbiguous { found, board: board_size, places },
    }
}
