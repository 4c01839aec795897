//! Which targets are looked for, as it is typed: `checkerboard 9x6 0.025`.

use std::fmt;

use nalgebra::Point3;
use range_image::Raster;
use targets::{
    BoardSighting, Checkerboard, CheckerboardOptions, CircleGrid, CircleGridOptions, find_checkerboard,
    find_circle_grid,
};

/// A kind of target, with its size.
#[derive(Debug, Clone, PartialEq)]
pub enum TargetKind {
    /// A checkerboard.
    Checkerboard(Checkerboard),
    /// A board of discs in rows and columns, or in rows that are shifted by half a spacing.
    Circles(CircleGrid),
}

impl TargetKind {
    /// The kind that words stand for: `checkerboard 9x6 0.025` (inner corners, side of a field in metre), `circles 10x10
    /// 0.0254` (discs, distance of their centres), `asymmetric-circles 4x11 0.02`, and behind these the diameter of the disc at
    /// the origin over that of the others, where it is larger.
    ///
    /// # Errors
    /// What was expected instead, in words.
    ///
    /// ```
    /// use target_tasks::TargetKind;
    ///
    /// let kind = TargetKind::parse(&["checkerboard", "9x6", "0.025"])?;
    /// assert_eq!(kind.to_string(), "checkerboard 9x6 0.025");
    /// assert!(TargetKind::parse(&["checkerboard", "9x6"]).is_err());
    /// # Ok::<(), String>(())
    /// ```
    pub fn parse<W: AsRef<str>>(words: &[W]) -> Result<Self, String> {
        const EXPECTED: &str = "expected `checkerboard 9x6 0.025` (inner corners, metre), `circles 10x10 0.0254` or \
                                `asymmetric-circles 4x11 0.02` (discs, metre between their centres), for discs with the \
                                diameter of a larger one at the origin over theirs behind it: `circles 10x10 0.0254 1.5`";
        let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
        let (kind, size, spacing, origin) = match words.as_slice() {
            [kind, size, spacing] => (*kind, *size, *spacing, None),
            [kind, size, spacing, origin] => (*kind, *size, *spacing, Some(*origin)),
            _ => return Err(format!("`{}` is no target: {EXPECTED}", words.join(" "))),
        };
        let [columns, rows] = parse_size(size).ok_or_else(|| format!("`{size}` is no size: {EXPECTED}"))?;
        let spacing_m = parse_number(spacing).ok_or_else(|| format!("`{spacing}` is no length: {EXPECTED}"))?;
        let with_origin = |grid: CircleGrid| match origin {
            None => Ok(Self::Circles(grid)),
            Some(text) => {
                let ratio =
                    parse_number(text).ok_or_else(|| format!("`{text}` is no ratio of diameters: {EXPECTED}"))?;
                grid.with_origin_dot(ratio).map(Self::Circles).map_err(|error| fault(&error))
            }
        };
        match kind {
            "checkerboard" if origin.is_none() => {
                Checkerboard::new(columns, rows, spacing_m).map(Self::Checkerboard).map_err(|error| fault(&error))
            }
            "circles" => {
                CircleGrid::symmetric(columns, rows, spacing_m).map_err(|error| fault(&error)).and_then(with_origin)
            }
            "asymmetric-circles" => {
                CircleGrid::asymmetric(columns, rows, spacing_m).map_err(|error| fault(&error)).and_then(with_origin)
            }
            _ => Err(format!("`{}` is no target: {EXPECTED}", words.join(" "))),
        }
    }

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

fn fault(error: &targets::Error) -> String {
    error.to_string()
}

fn parse_number(text: &str) -> Option<f64> {
    text.parse().ok()
}

fn parse_size(text: &str) -> Option<[usize; 2]> {
    let (columns, rows) = text.split_once('x')?;
    Some([columns.parse().ok()?, rows.parse().ok()?])
}

impl fmt::Display for TargetKind {
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
