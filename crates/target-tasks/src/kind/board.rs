//! Boards, whose points have places in a grid.

use std::fmt;

use nalgebra::Point3;
use range_image::Raster;
use targets::{
    BoardSighting, Checkerboard, CheckerboardOptions, CircleGrid, CircleGridOptions, find_checkerboard,
    find_circle_grid,
};

/// A kind of board.
#[derive(Debug, Clone, PartialEq)]
pub enum BoardKind {
    /// A checkerboard.
    Checkerboard(Checkerboard),
    /// A board of discs in rows and columns, or in rows that are shifted by half a spacing.
    Circles(CircleGrid),
}

impl BoardKind {
    /// Looks for the board in an image.
    pub(crate) fn find(&self, image: &Raster<f32>) -> std::result::Result<BoardSighting, targets::Error> {
        match self {
            Self::Checkerboard(board) => find_checkerboard(image, board, &CheckerboardOptions::default()),
            Self::Circles(grid) => find_circle_grid(image, grid, &CircleGridOptions::default()),
        }
    }

    /// Where a node lies on the board, metre.
    pub(crate) fn node_m(&self, node: [usize; 2]) -> Point3<f64> {
        match self {
            Self::Checkerboard(board) => board.node_m(node),
            Self::Circles(grid) => grid.node_m(node),
        }
    }

    /// Columns and rows of nodes.
    pub(crate) fn size(&self) -> [usize; 2] {
        match self {
            Self::Checkerboard(board) => [board.columns(), board.rows()],
            Self::Circles(grid) => [grid.columns(), grid.rows()],
        }
    }

    /// Name of a node among targets.
    pub(crate) fn name([column, row]: [usize; 2]) -> String {
        format!("C{column:02}R{row:02}")
    }
}

impl fmt::Display for BoardKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [columns, rows] = self.size();
        match self {
            Self::Checkerboard(board) => write!(f, "checkerboard {columns}x{rows} {}", board.square_m()),
            Self::Circles(grid) => {
                let name = if grid.is_staggered() { "asymmetric-circles" } else { "circles" };
                write!(f, "{name} {columns}x{rows} {}", grid.spacing_m())?;
                grid.origin_dot().map_or(Ok(()), |ratio| write!(f, " {ratio}"))
            }
        }
    }
}
