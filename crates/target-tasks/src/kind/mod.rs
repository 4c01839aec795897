//! Which targets are looked for, as it is typed: `checkerboard 9x6 0.025`.

mod board;
mod single;

use std::fmt;

use targets::{Checkerboard, CircleGrid};

pub use board::BoardKind;
pub use single::SingleKind;

/// A kind of target, with its size.
#[derive(Debug, Clone, PartialEq)]
pub enum TargetKind {
    /// Many points on one board, told by their places in its grid.
    Board(BoardKind),
    /// Single targets, told by their codes or by where they are.
    Single(SingleKind),
}

const EXPECTED: &str = "expected `checkerboard 9x6 0.025` (inner corners, metre), `circles 10x10 0.0254` or \
                        `asymmetric-circles 4x11 0.02` (discs, metre between their centres; behind it the diameter of a \
                        larger one at the origin over theirs: `circles 10x10 0.0254 1.5`), `rings 0.05` (coded rings, diameter \
                        of their discs), `discs`, `spheres`, `spheres 0.1` (radius) or `lights`";

impl TargetKind {
    /// The kind that words stand for: `checkerboard 9x6 0.025` (inner corners, side of a field in metre), `circles 10x10
    /// 0.0254` (discs, distance of their centres), `asymmetric-circles 4x11 0.02`, and behind these the diameter of the disc at
    /// the origin over that of the others, where it is larger; `rings 0.05` (coded rings, diameter of their discs in metre),
    /// `discs`, `spheres`, `spheres 0.1` (their radius, if it is known, in metre), `lights`.
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
    /// assert_eq!(TargetKind::parse(&["rings", "0.05"])?.to_string(), "rings 0.05");
    /// # Ok::<(), String>(())
    /// ```
    pub fn parse<W: AsRef<str>>(words: &[W]) -> Result<Self, String> {
        let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
        let unknown = || Err(format!("`{}` is no target: {EXPECTED}", words.join(" ")));
        match words.as_slice() {
            [kind @ ("checkerboard" | "circles" | "asymmetric-circles"), size, spacing, origin @ ..]
                if origin.len() <= 1 && !(*kind == "checkerboard" && origin.len() == 1) =>
            {
                Self::board(kind, size, spacing, origin.first().copied())
            }
            ["rings", diameter] => Ok(Self::Single(SingleKind::Rings { diameter_m: length(diameter, "diameter")? })),
            ["discs"] => Ok(Self::Single(SingleKind::Discs)),
            ["spheres"] => Ok(Self::Single(SingleKind::Spheres { radius_m: None })),
            ["spheres", radius] => Ok(Self::Single(SingleKind::Spheres { radius_m: Some(length(radius, "radius")?) })),
            ["lights"] => Ok(Self::Single(SingleKind::Lights)),
            _ => unknown(),
        }
    }

    fn board(kind: &str, size: &str, spacing: &str, origin: Option<&str>) -> Result<Self, String> {
        let [columns, rows] = parse_size(size).ok_or_else(|| format!("`{size}` is no size: {EXPECTED}"))?;
        let spacing_m = parse_number(spacing).ok_or_else(|| format!("`{spacing}` is no length: {EXPECTED}"))?;
        let fault = |error: targets::Error| error.to_string();
        if kind == "checkerboard" {
            let board = Checkerboard::new(columns, rows, spacing_m).map_err(fault)?;
            return Ok(Self::Board(BoardKind::Checkerboard(board)));
        }
        let make = if kind == "circles" { CircleGrid::symmetric } else { CircleGrid::asymmetric };
        let mut grid = make(columns, rows, spacing_m).map_err(fault)?;
        if let Some(text) = origin {
            let ratio = parse_number(text).ok_or_else(|| format!("`{text}` is no ratio of diameters: {EXPECTED}"))?;
            grid = grid.with_origin_dot(ratio).map_err(fault)?;
        }
        Ok(Self::Board(BoardKind::Circles(grid)))
    }
}

/// A length that is positive and finite.
fn length(text: &str, what: &str) -> Result<f64, String> {
    let value = parse_number(text).filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| format!("`{text}` is no {what} in metre: {EXPECTED}"))
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
        match self {
            Self::Board(kind) => kind.fmt(f),
            Self::Single(kind) => kind.fmt(f),
        }
    }
}
