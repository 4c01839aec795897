//! Whether the board ends at a side of a lattice: beyond the outer fields all is bright, as the paper about them.

use nalgebra::Vector2;

use super::assembly::Assembly;
use super::saddles::Level;
use crate::grid::homography::Homography;
use crate::grid::lattice::Node;

/// Directions out of a lattice: towards smaller columns, smaller rows, larger columns, larger rows.
pub(crate) const OUTWARD: [Node; 4] = [[-1, 0], [0, -1], [1, 0], [0, 1]];

/// What is beyond a side of a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// One more row of fields, and paper.
    Ends,
    /// More than one row of fields.
    GoesOn,
    /// The image's rim, a hand, a board without paper about it.
    Unknown,
}

/// Where the fields beyond a side are looked at, in steps from it: twice in the outer field, twice beyond. The paper
/// begins at one: what hides the board begins there by chance only, at every row.
const OUTER: [f64; 2] = [0.45, 0.75];
const BEYOND: [f64; 2] = [1.25, 1.5];

/// How far from the middle between dark and bright a value must lie, in parts of their difference: between them lie
/// blurred edges and what is no board.
const CLEAR: f64 = 0.15;

/// Share of the rows that must agree: one in five may hold a stain or a reflection.
const AGREE: f64 = 0.8;

/// Rows of fields that a side shows at least: the rim of what hides a board follows one by chance, and two seldom.
const LEAST_ROWS: usize = 3;

/// Fields about a side that are looked at, columns and rows: few, so that the lens does not bend them.
const ABOUT: i32 = 3;

/// What is beyond each of [`OUTWARD`].
pub(crate) fn sides(level: &Level, assembly: &Assembly, points: &[Vector2<f64>]) -> [Side; 4] {
    OUTWARD.map(|outward| side(level, assembly, points, outward))
}

/// Rows whose outer field has one colour: how many, and of how many the paper's place is dark or bright.
#[derive(Debug, Clone, Copy, Default)]
struct Tally {
    seen: usize,
    dark: usize,
    bright: usize,
}

impl Tally {
    fn mostly(count: usize, seen: usize) -> bool {
        seen > 0 && count as f64 >= AGREE * seen as f64
    }
}

fn side(level: &Level, assembly: &Assembly, points: &[Vector2<f64>], outward: Node) -> Side {
    let Some([low, high]) = assembly.lattice.bounds() else { return Side::Unknown };
    let along = [outward[1].abs(), outward[0].abs()];
    let start = if outward[0] + outward[1] < 0 { low } else { high };
    let [mut behind_dark, mut behind_bright] = [Tally::default(); 2];
    let count = along[0] * (high[0] - low[0]) + along[1] * (high[1] - low[1]);
    for k in 0..count {
        let node = [
            outward[0].abs() * start[0] + along[0] * (low[0] + k),
            outward[1].abs() * start[1] + along[1] * (low[1] + k),
        ];
        let Some((outer_is_bright, beyond)) = row(level, assembly, points, node, outward, along) else { continue };
        let tally = if outer_is_bright { &mut behind_bright } else { &mut behind_dark };
        tally.seen += 1;
        tally.dark += usize::from(beyond == Some(false));
        tally.bright += usize::from(beyond == Some(true));
    }
    // Dark fields are followed by bright in both cases; what follows bright ones tells.
    if behind_dark.seen + behind_bright.seen < LEAST_ROWS || !Tally::mostly(behind_dark.bright, behind_dark.seen) {
        return Side::Unknown;
    }
    if Tally::mostly(behind_bright.bright, behind_bright.seen) {
        Side::Ends
    } else if Tally::mostly(behind_bright.dark, behind_bright.seen) {
        Side::GoesOn
    } else {
        Side::Unknown
    }
}

/// Whether the outer field between a node and the next along the side is bright, and whether what is beyond is (`None`
/// where that is neither). `None` where the fields are not seen as expected.
fn row(
    level: &Level,
    assembly: &Assembly,
    points: &[Vector2<f64>],
    node: Node,
    outward: Node,
    along: Node,
) -> Option<(bool, Option<bool>)> {
    let inward = [node[0] - outward[0], node[1] - outward[1]];
    let beside = |node: Node| [node[0] + along[0], node[1] + along[1]];
    let needed = [node, inward, beside(node), beside(inward)];
    if !needed.iter().all(|node| assembly.lattice.nodes.contains_key(node)) {
        return None;
    }
    let map = assembly.lattice.map_about(points, node, ABOUT)?;
    let value = |out: f64| value(level, &map, outward, along, out);
    let (inner, outer) = (value(-0.5)?, value(OUTER[0])?);
    // The field between outward and along: by quarter turns from that between columns and rows.
    let turned = if outward[0] + outward[1] > 0 { 1.0 } else { -1.0 };
    let sign = assembly.sign_at(node) * turned;
    let contrast = (outer - inner) * sign;
    let middle = 0.5 * (outer + inner);
    // Written so that NaN is not seen as expected: outside the image, holes.
    let clear = |value: f64| (value - middle).abs() > CLEAR * contrast;
    let as_expected =
        contrast > 5.0 * level.noise && clear(value(OUTER[1])?) && (value(OUTER[1])? - middle) * sign > 0.0;
    if !as_expected {
        return None;
    }
    let [first, second] = [value(BEYOND[0])?, value(BEYOND[1])?];
    if first.is_nan() || second.is_nan() {
        return None;
    }
    let agree = clear(first) && clear(second) && (first > middle) == (second > middle);
    Some((sign > 0.0, agree.then_some(first > middle)))
}

/// The value between two rows, so many steps out of the lattice.
fn value(level: &Level, map: &Homography, outward: Node, along: Node, out: f64) -> Option<f64> {
    let place = |axis: usize| f64::from(outward[axis]) * out + f64::from(along[axis]) * 0.5;
    Some(level.at(map.map(Vector2::new(place(0), place(1)))?))
}
