//! Saddles that are corners of one board: seeds of three, grown along the edges between fields.

use nalgebra::Vector2;

use super::saddles::{Level, Saddle};
use crate::grid::lattice::{Candidates, Lattice, Node};
use crate::grid::nearest::Places;

/// How many of the nearest saddles may be the neighbours of a seed: eight nodes are about it, and some texture.
const NEAR: usize = 16;

/// Cosine of the largest angle between a seed's edge and the way to its neighbour: 20°, noise of the directions and
/// bending by the lens; half of what lies between neighbours and diagonals of a board that is tilted by 60°.
const COS_OF_CONE: f64 = 0.94;

/// Places along a side of a field where dark and bright must lie on their sides.
const ALONG: [f64; 4] = [0.26, 0.42, 0.58, 0.74];

/// How far beside the edge they are compared, in steps: inside fields that are seen half as wide as long.
const BESIDE: f64 = 0.18;

/// The same, least and most, pixel of the level: beyond the blur, and no further than needed.
const BESIDE_PX: [f64; 2] = [1.0, 4.0];

/// The least of the contrasts along an edge over the largest: light changes little along a field, another picture may.
const EVEN: f64 = 0.25;

/// Nodes that a lattice has at least.
const LEAST: usize = 9;

/// A lattice of saddles.
#[derive(Debug, Clone)]
pub(crate) struct Assembly {
    pub(crate) lattice: Lattice,
    /// Sign of the field between the columns' and the rows' direction at the node (0, 0): positive is bright.
    pub(crate) sign: f64,
}

impl Assembly {
    /// Sign of the field towards larger columns and rows at a node.
    pub(crate) fn sign_at(&self, [i, j]: Node) -> f64 {
        if (i + j).rem_euclid(2) == 0 { self.sign } else { -self.sign }
    }
}

/// The lattices among the saddles of a level, the largest first. No saddle is in two.
pub(crate) fn assemble(level: &Level, saddles: &[Saddle]) -> Vec<Assembly> {
    let points: Vec<Vector2<f64>> = saddles.iter().map(|saddle| saddle.position).collect();
    let places = Places::new(&points);
    let mut used = vec![false; saddles.len()];
    let mut found = Vec::new();
    for origin in 0..saddles.len() {
        if used[origin] {
            continue;
        }
        let is_edge = |from: usize, to: usize| !used[to] && is_edge(level, &saddles[from], &saddles[to]);
        let Some([along_u, along_v]) = neighbours(saddles, &places, origin, &is_edge) else { continue };
        let candidates = Candidates { points: &points, places: &places };
        let accept = |from: usize, to: usize, _: Node| is_edge(from, to);
        let lattice = Lattice::grow(&candidates, [origin, along_u, along_v], &accept);
        if lattice.nodes.len() < LEAST {
            continue;
        }
        let [u, v] = [along_u, along_v].map(|to| points[to] - points[origin]);
        let mut assembly = Assembly { lattice, sign: saddles[origin].mixed(u, v).signum() };
        bridge(&mut assembly, &candidates, saddles, &used);
        // Chance puts a saddle where a node would be, but no edge beside it, let alone two.
        assembly.lattice.retain_linked(2, &|from, to| is_edge(from, to));
        assembly.lattice.trim(2);
        assembly.lattice.nodes.values().for_each(|&point| used[point] = true);
        found.push(assembly);
    }
    found.retain(|assembly| assembly.lattice.nodes.len() >= LEAST);
    found.sort_by_key(|assembly| std::cmp::Reverse(assembly.lattice.nodes.len()));
    found
}

/// The nearest saddles along both edges of one, such that the second is a quarter turn clockwise (in the image) or less
/// than a half from the first.
fn neighbours(
    saddles: &[Saddle],
    places: &Places<'_>,
    origin: usize,
    is_edge: &impl Fn(usize, usize) -> bool,
) -> Option<[usize; 2]> {
    let here = saddles[origin].position;
    let edges = saddles[origin].edges();
    let near = places.nearest(here, NEAR + 1);
    let along = |edge: Vector2<f64>| {
        let in_cone = |to: usize| (saddles[to].position - here).normalize().dot(&edge).abs() >= COS_OF_CONE;
        near.iter().copied().find(|&to| to != origin && in_cone(to) && is_edge(origin, to))
    };
    let [first, second] = [along(edges[0])?, along(edges[1])?];
    let cross = (saddles[first].position - here).perp(&(saddles[second].position - here));
    match cross {
        cross if cross > 0.0 => Some([first, second]),
        cross if cross < 0.0 => Some([second, first]),
        _ => None,
    }
}

/// Whether the line between two saddles is the edge between a dark and a bright field, and they turn opposite sides.
fn is_edge(level: &Level, from: &Saddle, to: &Saddle) -> bool {
    let step = to.position - from.position;
    let length = step.norm();
    let across = Vector2::new(-step.y, step.x) / length;
    let [from_sign, to_sign] = [from, to].map(|saddle| saddle.mixed(step, across).signum());
    if from_sign * to_sign >= 0.0 {
        return false;
    }
    let beside = across * (BESIDE * length / level.pixel).clamp(BESIDE_PX[0], BESIDE_PX[1]) * level.pixel;
    let contrasts = ALONG.map(|share| {
        let place = from.position + step * share;
        from_sign * (level.at(place + beside) - level.at(place - beside))
    });
    let [least, most] = [f64::min, f64::max].map(|pick| contrasts.into_iter().reduce(pick).unwrap_or(f64::NAN));
    // Three deviations of a difference of two smoothed values.
    least > EVEN * most && most > 3.0 * std::f64::consts::SQRT_2 * level.noise
}

/// Nodes beyond a gap of two.
fn bridge(assembly: &mut Assembly, candidates: &Candidates<'_>, saddles: &[Saddle], used: &[bool]) {
    let sign = assembly.sign;
    let accept = |[i, j]: Node, point: usize, [u, v]: [Vector2<f64>; 2]| {
        let expected = if (i + j).rem_euclid(2) == 0 { sign } else { -sign };
        let mixed = saddles[point].mixed(u.normalize(), v.normalize());
        // A saddle whose edges lie along the fields' has most of its curvature between them.
        !used[point] && mixed * expected > 0.5 * saddles[point].strength
    };
    assembly.lattice.bridge(candidates, 2, &accept);
}
