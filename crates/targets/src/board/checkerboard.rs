//! What is looked for.

use nalgebra::Point3;

use crate::error::{Error, Result};

/// A checkerboard by its inner corners: the nodes where four fields meet.
///
/// Board frame: node (0, 0) at the origin, x to the right, y up, z towards the viewer; metre.
///
/// ```
/// let board = targets::Checkerboard::new(9, 6, 0.025)?;
/// let node = board.node_m([2, 1]);
/// assert!((node.x - 0.05).abs() < 1e-15 && (node.y + 0.025).abs() < 1e-15);
/// # Ok::<(), targets::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checkerboard {
    columns: usize,
    rows: usize,
    square_m: f64,
}

/// Nodes along one side at most: a larger board would have fields of less than a pixel in any image that is read.
const LARGEST_SIDE: usize = 1000;

impl Checkerboard {
    /// A board of `columns` x `rows` inner corners (2 x 2 to 1000 x 1000, nine at least) and fields of `square_m` metre.
    pub fn new(columns: usize, rows: usize, square_m: f64) -> Result<Self> {
        for (name, value) in [("columns", columns), ("rows", rows)] {
            if !(2..=LARGEST_SIDE).contains(&value) {
                let expected = "a board has 2 to 1000 inner corners along a side";
                return Err(Error::Invalid { name, value: value as f64, expected });
            }
        }
        if columns * rows < LEAST_NODES {
            let expected = "a board has at least nine inner corners";
            return Err(Error::Invalid { name: "columns * rows", value: (columns * rows) as f64, expected });
        }
        if !(square_m.is_finite() && square_m > 0.0) {
            let expected = "the side of a field is positive and finite";
            return Err(Error::Invalid { name: "square_m", value: square_m, expected });
        }
        Ok(Self { columns, rows, square_m })
    }

    /// Inner corners along x.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Inner corners along y.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Side of a field, metre.
    pub fn square_m(&self) -> f64 {
        self.square_m
    }

    /// Where the node of a column and a row is, board frame, metre: `x = i · square`, `y = −j · square`.
    pub fn node_m(&self, [i, j]: [usize; 2]) -> Point3<f64> {
        Point3::new(i as f64 * self.square_m, -(j as f64) * self.square_m, 0.0)
    }

    /// Whether the colours of the fields tell a turned board: if its corners do not all have one colour, or opposite ones
    /// have the same and the board is a square.
    pub(crate) fn colours_matter(&self) -> bool {
        (self.columns + self.rows) % 2 == 1 || (self.columns == self.rows && self.columns % 2 == 1)
    }

    /// How many turns of the board look the same.
    pub(crate) fn symmetry(&self) -> usize {
        let turns = if self.columns == self.rows { 4 } else { 2 };
        if self.colours_matter() { turns / 2 } else { turns }
    }
}

/// Nodes that a board and a seen part of one have at least: fewer are found by chance in what is no board.
const LEAST_NODES: usize = 9;

/// How a board is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckerboardOptions {
    /// Standard deviation of the noise, unit of the image, positive; covariances are not below what it makes them. Default:
    /// `None`, estimated from the image.
    pub noise: Option<f64>,
    /// Share of the board's nodes that must be seen, above 0, at most 1: at 1 a board must be seen whole. Nine nodes are
    /// needed in any case. Default: 0.2.
    pub least_share: f64,
}

impl Default for CheckerboardOptions {
    fn default() -> Self {
        Self { noise: None, least_share: 0.2 }
    }
}

impl CheckerboardOptions {
    /// Nodes of a board that must be seen.
    pub(crate) fn least_nodes(&self, board: &Checkerboard) -> usize {
        ((self.least_share * (board.columns() * board.rows()) as f64).ceil() as usize).max(LEAST_NODES)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        if let Some(value) = self.noise.filter(|noise| !(noise.is_finite() && *noise > 0.0)) {
            return Err(Error::Invalid {
                name: "noise",
                value,
                expected: "a standard deviation is positive and finite",
            });
        }
        let value = self.least_share;
        if !(value > 0.0 && value <= 1.0) {
            return Err(Error::Invalid { name: "least_share", value, expected: "a share above 0, at most 1" });
        }
        Ok(())
    }
}
