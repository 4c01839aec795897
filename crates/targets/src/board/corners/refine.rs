//! All corners of a lattice.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix2, Vector2};
use range_image::Raster;
use statistics::{Distribution, chi_squared_limit, upper_median};

use super::covered::{excess, without_covered};
use super::crossing::Crossing;
use super::fit::{Fitted, Problem};
use super::window::{Expected, Pixel};
use crate::board::assembly::Assembly;
use crate::grid::lattice::Node;
use crate::image::normal_table::NormalTable;

/// How far from where the lattice has it a corner may be found, in steps.
const FARTHEST: f64 = 0.25;

/// Residuals beyond this part of the half contrast belong to something that is no corner: a finger, a stain.
const NO_CORNER: f64 = 0.2;

/// Probability at which the residuals of a corner are larger than those of all by chance.
const LEVEL: f64 = 1e-3;

/// Deviations of its noise that the contrast must exceed.
const SIGNIFICANT: f64 = 6.0;

/// Nodes over which the bending of the edges is averaged, columns and rows: fewer, and the noise of the corners bends edges
/// that are straight; more, and the lens changes over them.
const ABOUT: i32 = 2;

/// A corner with its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Corner {
    pub(crate) node: Node,
    pub(crate) position: Vector2<f64>,
    pub(crate) covariance: Matrix2<f64>,
}

/// The image that corners are measured in.
pub(crate) struct Measured<'a> {
    pub(crate) image: &'a Raster<f32>,
    /// Deviation of the noise.
    pub(crate) noise: f64,
    /// The least that is believed of it.
    pub(crate) least_noise: f64,
    /// Value at which the sensor saturates; infinite if it does not.
    pub(crate) plateau: f64,
}

/// The corners of a lattice, by column and row, from where the saddles are. Those that are no corners are left out.
pub(crate) fn refine(measured: &Measured<'_>, assembly: &Assembly, points: &mut [Vector2<f64>]) -> Vec<Corner> {
    let table = NormalTable::new();
    let sight = |points: &[Vector2<f64>], earlier: Option<&BTreeMap<Node, Fitted>>| {
        let windows = windows(measured, &table, assembly, points, earlier);
        uncovered(measured, assembly, &windows)
    };
    let fitted = sight(points, None);
    // Again from better neighbours: what lies beside the fields and how the edges bend is by them.
    for (node, fit) in &fitted {
        if let Some(&point) = assembly.lattice.nodes.get(node) {
            points[point] = fit.position;
        }
    }
    let earlier = fitted.into_iter().collect();
    with_covariance(measured, assembly, &sight(points, Some(&earlier)))
}

/// A node, what its corner is fitted to, and the corner.
struct Window<'a> {
    node: Node,
    expected: Expected,
    crossing: Crossing<'a>,
    pixels: Vec<Pixel>,
    fitted: Fitted,
}

impl Window<'_> {
    fn problem(&self, measured: &Measured<'_>) -> Problem<'_> {
        let crossing = Crossing { table: self.crossing.table, spans: self.crossing.spans };
        Problem { crossing, pixels: &self.pixels, noise: measured.noise, plateau: measured.plateau }
    }
}

fn windows<'a>(
    measured: &Measured<'_>,
    table: &'a NormalTable,
    assembly: &Assembly,
    points: &[Vector2<f64>],
    earlier: Option<&BTreeMap<Node, Fitted>>,
) -> Vec<Window<'a>> {
    let window = |&node: &Node| {
        let expected = expected(assembly, points, node, earlier)?;
        let pixels = expected.window(measured.image);
        let spans = spans(assembly, points, node, &expected)?;
        let problem = Problem {
            crossing: Crossing { table, spans },
            pixels: &pixels,
            noise: measured.noise,
            plateau: measured.plateau,
        };
        let begin = earlier.and_then(|earlier| earlier.get(&node));
        let fitted = problem.fit(&expected, assembly.sign_at(node), begin)?;
        let crossing = Crossing { table, spans };
        let window = Window { node, expected, crossing, pixels, fitted };
        is_corner(measured, assembly, &window, &fitted).then_some(window)
    };
    assembly.lattice.nodes.keys().filter_map(window).collect()
}

/// Whether a fit is a corner of the board: near where it is expected, with the contrast that belongs there.
fn is_corner(measured: &Measured<'_>, assembly: &Assembly, window: &Window<'_>, fitted: &Fitted) -> bool {
    let size = [measured.image.width(), measured.image.height()];
    let inside = fitted.position.iter().zip(size).all(|(at, size)| *at >= 0.0 && *at <= size as f64 - 1.0);
    let moved = (fitted.position - window.expected.position).norm();
    inside
        && moved <= FARTHEST * shorter(&window.expected)
        && fitted.contrast() * assembly.sign_at(window.node) > SIGNIFICANT * fitted.contrast_deviation
}

/// The corners by what nothing covers of their windows.
fn uncovered(measured: &Measured<'_>, assembly: &Assembly, windows: &[Window<'_>]) -> Vec<(Node, Fitted)> {
    let sigma = common_variance(measured, windows.iter().map(|window| &window.fitted)).sqrt();
    // Edges of real images differ from the model in every window: what half of the windows show covers none.
    let mut excesses: Vec<f64> =
        windows.iter().map(|window| excess(&window.problem(measured), &window.fitted, sigma)).collect();
    let usual = if excesses.is_empty() { 1.0 } else { upper_median(&mut excesses).max(1.0) };
    let sigma = sigma * usual;
    let fit = |window: &Window<'_>| {
        let (problem, sign) = (window.problem(measured), assembly.sign_at(window.node));
        let fitted = without_covered(&problem, &window.expected, sign, sigma, window.fitted)?;
        is_corner(measured, assembly, window, &fitted).then_some((window.node, fitted))
    };
    windows.iter().filter_map(fit).collect()
}

fn shorter(expected: &Expected) -> f64 {
    expected.steps[0].norm().min(expected.steps[1].norm())
}

/// Where a node's corner is expected; `None` where it has no neighbour along columns or rows.
fn expected(
    assembly: &Assembly,
    points: &[Vector2<f64>],
    node: Node,
    earlier: Option<&BTreeMap<Node, Fitted>>,
) -> Option<Expected> {
    let at = |i: i32, j: i32| assembly.lattice.nodes.get(&[node[0] + i, node[1] + j]).map(|&k| points[k]);
    let position = at(0, 0)?;
    let step = |i: i32, j: i32| match (at(i, j), at(-i, -j)) {
        (Some(next), Some(last)) => Some((next - last) / 2.0),
        (Some(next), None) => Some(next - position),
        (None, Some(last)) => Some(position - last),
        (None, None) => None,
    };
    Some(Expected {
        position,
        steps: [step(1, 0)?, step(0, 1)?],
        curvatures: curvatures(assembly, points, node, earlier),
    })
}

/// Curvature of the edges along columns and rows, from three nodes in a line each: the median over the nodes about, as what covers a
/// corner may be taken for one that lies pixels away; those that an earlier fit found, if there is one.
fn curvatures(
    assembly: &Assembly,
    points: &[Vector2<f64>],
    node: Node,
    earlier: Option<&BTreeMap<Node, Fitted>>,
) -> [f64; 2] {
    let is_known = |node: &Node| earlier.is_none_or(|earlier| earlier.contains_key(node));
    let at = |i: i32, j: i32| assembly.lattice.nodes.get(&[i, j]).filter(|_| is_known(&[i, j])).map(|&k| points[k]);
    [[1, 0], [0, 1]].map(|[di, dj]| {
        let curvature = |(i, j): (i32, i32)| {
            let (last, here, next) = (at(i - di, j - dj)?, at(i, j)?, at(i + di, j + dj)?);
            let step = (next - last) / 2.0;
            Some(step.perp(&(next - here * 2.0 + last)) / step.norm().powi(3))
        };
        let columns = node[0] - ABOUT..=node[0] + ABOUT;
        let nodes = columns.flat_map(|i| (node[1] - ABOUT..=node[1] + ABOUT).map(move |j| (i, j)));
        let mut about: Vec<f64> = nodes.filter_map(curvature).collect();
        if about.is_empty() { 0.0 } else { upper_median(&mut about) }
    })
}

/// Distances of the edges beside those of a node; as far as the step, where no node is known.
fn spans(assembly: &Assembly, points: &[Vector2<f64>], node: Node, expected: &Expected) -> Option<[[f64; 2]; 2]> {
    let normals = expected.normals()?;
    let towards = |edge: usize, sign: i32| {
        // The edge along columns has its neighbours at other rows.
        let neighbour = if edge == 0 { [node[0], node[1] + sign] } else { [node[0] + sign, node[1]] };
        let known = assembly.lattice.nodes.get(&neighbour).map(|&k| points[k] - expected.position);
        let offset = known.unwrap_or(expected.steps[1 - edge] * f64::from(sign));
        normals[edge].dot(&offset) * f64::from(sign)
    };
    let spans = [0, 1].map(|edge| [towards(edge, -1), towards(edge, 1)]);
    spans.iter().flatten().all(|span| *span > 0.0).then_some(spans)
}

/// Covariances for the scatter of the residuals: of all corners, or of one alone where its own is larger than chance makes
/// it. Not below the noise that is believed at least.
fn with_covariance(measured: &Measured<'_>, assembly: &Assembly, fitted: &[(Node, Fitted)]) -> Vec<Corner> {
    let seen: BTreeSet<Node> = fitted.iter().map(|(node, _)| *node).collect();
    // Beside a node of the board that is not seen: what hides that one may hide a part of this one's window.
    let beside_hidden = |[i, j]: Node| {
        let mut about = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| [i, j]));
        about.any(|other| assembly.lattice.nodes.contains_key(&other) && !seen.contains(&other))
    };
    let given = measured.noise * measured.noise;
    let common = common_variance(measured, fitted.iter().map(|(_, fit)| fit));
    let corner = |(node, fit): &(Node, Fitted)| {
        let by_chance = common * chi_squared_limit(fit.freedom, LEVEL) / fit.freedom;
        let excessive = fit.variance > by_chance;
        let is_no_corner = fit.variance.sqrt() > NO_CORNER * fit.contrast().abs() || beside_hidden(*node);
        if excessive && is_no_corner {
            return None;
        }
        let variance = if excessive { fit.variance } else { common };
        Some(Corner { node: *node, position: fit.position, covariance: fit.covariance * (variance / given) })
    };
    fitted.iter().filter_map(corner).collect()
}

/// Variance of the residuals of most corners: not below the noise that is believed at least.
fn common_variance<'a>(measured: &Measured<'_>, fitted: impl Iterator<Item = &'a Fitted>) -> f64 {
    // Each variance over the median of its distribution, so that a half lies on either side.
    let relative =
        |fit: &Fitted| fit.variance * fit.freedom / Distribution::ChiSquared { dof: fit.freedom }.quantile(0.5);
    let scatter = upper_median(&mut fitted.map(relative).collect::<Vec<_>>());
    scatter.max(measured.least_noise * measured.least_noise)
}
