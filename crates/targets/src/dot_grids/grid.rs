//! What is looked for.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::circles::options::CircleOptions;
use crate::error::{Error, Result};
use crate::grid::lattice::Node;

/// Dots along one side at most.
const LARGEST_SIDE: usize = 1000;
/// Dots that a grid and a seen part of one have at least: fewer are found by chance in what is no grid.
const LEAST_NODES: usize = 9;

/// A grid of equal dots.
///
/// Board frame: node (0, 0) at the origin, x to the right, y up, z towards the viewer; metre.
///
/// ```
/// use targets::CircleGrid;
///
/// let grid = CircleGrid::symmetric(10, 10, 0.02)?.with_origin_dot(2.0)?;
/// let node = grid.node_m([2, 1]);
/// assert!((node.x - 0.04).abs() < 1e-15 && (node.y + 0.02).abs() < 1e-15);
///
/// let staggered = CircleGrid::asymmetric(4, 11, 0.02)?;
/// assert!((staggered.node_m([0, 1]).x - 0.02).abs() < 1e-15);
/// # Ok::<(), targets::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleGrid {
    columns: usize,
    rows: usize,
    spacing_m: f64,
    is_staggered: bool,
    origin_dot: Option<f64>,
}

impl CircleGrid {
    /// Dots in columns and rows (2 x 2 to 1000 x 1000, nine at least), `spacing_m` metre apart: `x = i · spacing`,
    /// `y = −j · spacing`.
    pub fn symmetric(columns: usize, rows: usize, spacing_m: f64) -> Result<Self> {
        Self { columns, rows, spacing_m, is_staggered: false, origin_dot: None }.checked()
    }

    /// The layout that OpenCV calls asymmetric: `rows` rows of `columns` dots, `spacing_m` metre from row to row and twice that
    /// from dot to dot, every other row moved by half of that: `x = (2i + j mod 2) · spacing`, `y = −j · spacing`. With an odd
    /// number of rows no turn of it looks the same.
    pub fn asymmetric(columns: usize, rows: usize, spacing_m: f64) -> Result<Self> {
        Self { columns, rows, spacing_m, is_staggered: true, origin_dot: None }.checked()
    }

    /// The same grid with a larger dot at node (0, 0), of `ratio` times the diameter of the others (1.3 to 3): it tells turned
    /// grids apart.
    pub fn with_origin_dot(self, ratio: f64) -> Result<Self> {
        if !(1.3..=3.0).contains(&ratio) {
            let expected = "the dot at the origin has 1.3 to 3 times the diameter of the others";
            return Err(Error::Invalid { name: "origin_dot", value: ratio, expected });
        }
        Ok(Self { origin_dot: Some(ratio), ..self })
    }

    fn checked(self) -> Result<Self> {
        for (name, value) in [("columns", self.columns), ("rows", self.rows)] {
            if !(2..=LARGEST_SIDE).contains(&value) {
                let expected = "a grid has 2 to 1000 dots along a side";
                return Err(Error::Invalid { name, value: value as f64, expected });
            }
        }
        if self.columns * self.rows < LEAST_NODES {
            let (value, expected) = ((self.columns * self.rows) as f64, "a grid has at least nine dots");
            return Err(Error::Invalid { name: "columns * rows", value, expected });
        }
        if !(self.spacing_m.is_finite() && self.spacing_m > 0.0) {
            let expected = "the spacing is positive and finite";
            return Err(Error::Invalid { name: "spacing_m", value: self.spacing_m, expected });
        }
        Ok(self)
    }

    /// Dots in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Metre from row to row.
    pub fn spacing_m(&self) -> f64 {
        self.spacing_m
    }

    /// Whether every other row is moved.
    pub fn is_staggered(&self) -> bool {
        self.is_staggered
    }

    /// Diameter of the dot at the origin in parts of the others', if it is larger.
    pub fn origin_dot(&self) -> Option<f64> {
        self.origin_dot
    }

    /// Where the dot of a column and a row is, board frame, metre.
    pub fn node_m(&self, [i, j]: [usize; 2]) -> Point3<f64> {
        let x = if self.is_staggered { 2 * i + j % 2 } else { i };
        Point3::new(x as f64 * self.spacing_m, -(j as f64) * self.spacing_m, 0.0)
    }

    /// Number of dots.
    pub(crate) fn count(&self) -> usize {
        self.columns * self.rows
    }

    /// The nodes by their place in a lattice without gaps: columns and rows; of a staggered grid its diagonals, to the right and
    /// down, and to the left and down.
    pub(crate) fn lattice(&self) -> BTreeMap<Node, [usize; 2]> {
        let nodes = (0..self.rows).flat_map(|j| (0..self.columns).map(move |i| [i, j]));
        nodes
            .map(|[i, j]| {
                let (x, y) = ((2 * i + j % 2) as i32, j as i32);
                let place =
                    if self.is_staggered { [(x + y).div_euclid(2), (y - x).div_euclid(2)] } else { [i as i32, y] };
                (place, [i, j])
            })
            .collect()
    }
}

/// How a grid of dots is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleGridOptions {
    /// How its dots are looked for. Default: as for [`CircleOptions`].
    pub circles: CircleOptions,
    /// Share of the dots that must be seen, above 0, at most 1; nine in any case. Default: 0.5.
    pub least_share: f64,
}

impl Default for CircleGridOptions {
    fn default() -> Self {
        Self { circles: CircleOptions::default(), least_share: 0.5 }
    }
}

impl CircleGridOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        let value = self.least_share;
        if !(value > 0.0 && value <= 1.0) {
            return Err(Error::Invalid { name: "least_share", value, expected: "a share above 0, at most 1" });
        }
        self.circles.validate()
    }

    pub(crate) fn least_nodes(&self, grid: &CircleGrid) -> usize {
        ((self.least_share * grid.count() as f64).ceil() as usize).max(LEAST_NODES)
    }
}
