use std::collections::BTreeMap;

use crate::grid::scatter::widen;
use nalgebra::Vector2;
use range_image::Raster;
use statistics::{CHI_MEDIANS, upper_median};

use super::centres::to_circle_centres;
use super::grid::{CircleGrid, CircleGridOptions};
use super::labelling::{Labelling, are_turns, bounds, labellings};
use super::lattices::lattices;
use super::sizes::are_larger;
use crate::circles::find::{CircleSighting, find_circles};
use crate::error::{NotFound, Result};
use crate::grid::lattice::{Lattice, Node};
use crate::image::levels::Levels;
use crate::image::noise::noise_deviation;
use crate::sightings::measured_point::{BoardSighting, NodePoint};

/// Largest over smallest value in standard deviations of the noise of an image without any contrast: a million normal values span
/// ten.
const NO_CONTRAST: f64 = 12.0;

/// Nodes about a node that predict it, columns and rows: the lens is smooth over them.
const ABOUT: i32 = 2;

/// Finds a grid of dots and says which dot is which.
///
/// The dots are those of [`find_circles`]; lattices are grown among them, and a lattice is the grid if all its dots have a place on
/// it. The points are the images of the dots' centres, which are not those of the ellipses.
/// Labels are never guessed: what fits in several ways that are not mere turns of the whole grid is an error. A mirror image
/// is refused where the grid is not its own: with an origin dot, and other numbers of columns and rows.
///
/// # Errors
/// [`crate::Error::Invalid`] for options that cannot be met; otherwise [`NotFound`] with the reason.
///
/// ```
/// use targets::range_image::Raster;
/// use targets::{CircleGrid, CircleGridOptions, find_circle_grid};
///
/// // Dots of radius 4, 15 pixels apart, the first at (20, 20) and larger.
/// let image = Raster::from_fn(100, 80, |col, row| {
///     let [i, j] = [col, row].map(|at| ((at as f32 - 20.0) / 15.0).round());
///     let radius = if i == 0.0 && j == 0.0 { 6.5 } else { 4.0 };
///     let edge = radius + 0.5 - (col as f32 - 20.0 - 15.0 * i).hypot(row as f32 - 20.0 - 15.0 * j);
///     let is_dot = (0.0..5.0).contains(&i) && (0.0..4.0).contains(&j);
///     if is_dot { 200.0 - 150.0 * edge.clamp(0.0, 1.0) } else { 200.0 }
/// });
/// let grid = CircleGrid::symmetric(5, 4, 0.02)?.with_origin_dot(1.6)?;
/// let seen = find_circle_grid(&image, &grid, &CircleGridOptions::default())?;
/// assert!(seen.complete && seen.ambiguity == 1 && seen.nodes[1].node == [1, 0]);
/// assert!((seen.nodes[1].point.pixel[0] - 35.0).abs() < 0.02);
/// # Ok::<(), targets::Error>(())
/// ```
pub fn find_circle_grid(image: &Raster<f32>, grid: &CircleGrid, options: &CircleGridOptions) -> Result<BoardSighting> {
    options.validate()?;
    let sightings = find_circles(image, &options.circles)?;
    let needed = options.least_nodes(grid);
    if sightings.len() < needed {
        return Err(too_few(image, sightings.len(), needed).into());
    }
    let mut lattices = lattices(&sightings, grid.origin_dot().unwrap_or(1.0));
    let largest = lattices.first().map_or(0, |lattice| lattice.nodes.len());
    lattices.retain(|lattice| lattice.nodes.len() >= needed);
    if lattices.is_empty() {
        return Err(NotFound::NoGrid { points: sightings.len(), largest, needed }.into());
    }
    let board = Board::new(grid);
    let mut laid: Vec<Laid<'_>> = lattices.iter().map(|lattice| Laid::new(lattice, &sightings, &board)).collect();
    let known = laid.iter().filter(|laid| !laid.labellings.is_empty()).count();
    if known > 1 {
        return Err(NotFound::SeveralBoards { found: known }.into());
    }
    let place = laid.iter().position(|laid| !laid.labellings.is_empty()).unwrap_or(0);
    Ok(laid.swap_remove(place).sighting(&board)?)
}

/// Why an image has too few dots: because it has no contrast, or is saturated, or else for no reason that it tells.
fn too_few(image: &Raster<f32>, found: usize, needed: usize) -> NotFound {
    let noise = noise_deviation(image);
    let finite = || image.as_slice().iter().copied().filter(|value| value.is_finite());
    let contrast = f64::from(finite().fold(f32::NEG_INFINITY, f32::max) - finite().fold(f32::INFINITY, f32::min));
    if noise.is_nan() || contrast <= NO_CONTRAST * noise {
        return NotFound::NoContrast { contrast, noise };
    }
    let saturated = Levels::of(image, noise).map_or(0.0, |levels| levels.saturated);
    NotFound::TooFewPoints { found, needed }.with_saturation(saturated)
}

/// The grid in its lattice.
struct Board<'a> {
    grid: &'a CircleGrid,
    nodes: BTreeMap<Node, [usize; 2]>,
    origin: Option<Node>,
}

impl<'a> Board<'a> {
    fn new(grid: &'a CircleGrid) -> Self {
        Self { grid, nodes: grid.lattice(), origin: grid.origin_dot().map(|_| [0, 0]) }
    }
}

/// A lattice, and how it may lie on the grid.
struct Laid<'a> {
    lattice: &'a Lattice,
    sightings: &'a [CircleSighting],
    larger: BTreeMap<Node, bool>,
    labellings: Vec<Labelling>,
}

impl<'a> Laid<'a> {
    fn new(lattice: &'a Lattice, sightings: &'a [CircleSighting], board: &Board<'_>) -> Self {
        let larger = are_larger(lattice, sightings, board.grid.origin_dot().unwrap_or(1.0));
        let labellings = labellings(&larger, &board.nodes, board.origin, 1);
        Self { lattice, sightings, larger, labellings }
    }

    fn sighting(self, board: &Board<'_>) -> std::result::Result<BoardSighting, NotFound> {
        let labelling = self.upper_left(board).ok_or_else(|| self.refusal(board))?;
        let (found, size) = (self.size(board), [board.grid.columns(), board.grid.rows()]);
        if !are_turns(&self.labellings, &self.larger, &board.nodes, board.origin) {
            return Err(NotFound::PartAmbiguous { found, board: size, places: self.labellings.len() });
        }
        let node = |(place, index): (&Node, &usize)| {
            let node = *board.nodes.get(&labelling.apply(*place))?;
            let sighting = &self.sightings[*index];
            Some((NodePoint { node, point: sighting.centre }, sighting.ellipse))
        };
        let mut seen: Vec<_> = self.lattice.nodes.iter().filter_map(node).collect();
        to_circle_centres(&mut seen, |node| board.grid.node_m(node), board.grid.origin_dot().unwrap_or(1.0));
        let mut nodes: Vec<NodePoint> = seen.into_iter().map(|(point, _)| point).collect();
        nodes.sort_by_key(|point| [point.node[1], point.node[0]]);
        widen(&mut nodes);
        Ok(BoardSighting {
            complete: nodes.len() == board.grid.count(),
            nodes,
            ambiguity: self.labellings.len(),
            residual_px: self.residual_px(),
        })
    }

    /// The labelling whose node (0, 0) is nearest to the upper left corner of the image.
    fn upper_left(&self, board: &Board<'_>) -> Option<Labelling> {
        let points = self.points();
        let from_corner = |labelling: &Labelling| {
            let at_origin = self.lattice.nodes.iter().find(|(node, _)| labelling.apply(**node) == [0, 0]);
            let seen = at_origin.map(|(_, &index)| points[index].norm());
            // Where it is hidden: the node of the smallest column and row that is seen.
            let least = self.lattice.nodes.iter().min_by_key(|(node, _)| {
                let [i, j] = board.nodes.get(&labelling.apply(**node)).copied().unwrap_or_default();
                i + j
            });
            seen.or_else(|| least.map(|(_, &index)| points[index].norm())).unwrap_or(f64::INFINITY)
        };
        self.labellings.iter().copied().min_by(|a, b| from_corner(a).total_cmp(&from_corner(b)))
    }

    /// Why no labelling fits.
    fn refusal(&self, board: &Board<'_>) -> NotFound {
        let found = self.size(board);
        if !labellings(&self.larger, &board.nodes, board.origin, -1).is_empty() {
            NotFound::Mirrored
        } else if !labellings(&self.larger, &board.nodes, None, 1).is_empty() {
            NotFound::WrongMark { found, larger: self.larger.values().filter(|larger| **larger).count() }
        } else {
            NotFound::WrongSize { found, board: [board.grid.columns(), board.grid.rows()] }
        }
    }

    /// Columns and rows that the lattice spans: of a staggered grid, dots in a row and rows.
    fn size(&self, board: &Board<'_>) -> [usize; 2] {
        let staggered: Vec<Node> = self.lattice.nodes.keys().map(|[a, b]| [(a - b).div_euclid(2), a + b]).collect();
        let plain: Vec<Node> = self.lattice.nodes.keys().copied().collect();
        let nodes = if board.grid.is_staggered() { staggered } else { plain };
        bounds(nodes.iter()).map_or([0; 2], |[low, high]| [0, 1].map(|axis| (high[axis] - low[axis] + 1) as usize))
    }

    fn points(&self) -> Vec<Vector2<f64>> {
        self.sightings.iter().map(|sighting| sighting.centre.pixel.into()).collect()
    }

    /// Robust deviation of the dots from where those about them have them, pixel, both coordinates together.
    fn residual_px(&self) -> f64 {
        let points = self.points();
        let deviation = |(node, index): (&Node, &usize)| {
            let place = self.lattice.predict(&points, *node, ABOUT)?;
            Some((place.position - points[*index]).norm())
        };
        let mut deviations: Vec<f64> = self.lattice.nodes.iter().filter_map(deviation).collect();
        upper_median(&mut deviations) / CHI_MEDIANS[1] * std::f64::consts::SQRT_2
    }
}
