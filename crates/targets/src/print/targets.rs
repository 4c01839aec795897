//! The targets on their page.

use super::page::{Page, PaperSize};
use crate::board::Checkerboard;
use crate::coded::{Code, GROUND, RING};
use crate::dot_grids::CircleGrid;
use crate::error::{Error, Result};

const MM: f64 = 1000.0;

/// A checkerboard as one page of SVG in millimetre: fields to scale, the upper left one black, a field of white about them.
///
/// # Errors
/// [`Error::Invalid`] where it does not fit the paper.
///
/// ```
/// use targets::{Checkerboard, PaperSize, print_checkerboard};
///
/// let page = print_checkerboard(&Checkerboard::new(9, 6, 0.018)?, PaperSize::A4)?;
/// assert!(page.starts_with("<svg") && page.contains("297mm"));
/// # Ok::<(), targets::Error>(())
/// ```
pub fn print_checkerboard(board: &Checkerboard, paper: PaperSize) -> Result<String> {
    let (side, fields) = (MM * board.square_m(), [board.columns() + 1, board.rows() + 1]);
    let mut page = Page::new(paper, fields.map(|count| (count + 2) as f64 * side))?;
    for row in 0..fields[1] {
        for column in (row % 2..fields[0]).step_by(2) {
            page.rectangle([(column + 1) as f64 * side, (row + 1) as f64 * side], [side; 2], "black");
        }
    }
    let size = format!("{} x {} inner corners, {side:.3} mm", board.columns(), board.rows());
    Ok(page.finished(&format!("Checkerboard, {size}. Node (0, 0) is the upper left corner; x right, y up.")))
}

/// A grid of black dots of a diameter as one page of SVG in millimetre, the larger dot at the origin if it has one.
///
/// # Errors
/// [`Error::Invalid`] for dots that touch, and where the grid does not fit the paper.
pub fn print_circle_grid(grid: &CircleGrid, diameter_m: f64, paper: PaperSize) -> Result<String> {
    let largest = diameter_m * grid.origin_dot().unwrap_or(1.0);
    // Neighbours of a staggered grid are a diagonal apart.
    let apart = grid.spacing_m() * if grid.is_staggered() { std::f64::consts::SQRT_2 } else { 1.0 };
    if !(diameter_m > 0.0 && 0.5 * (diameter_m + largest) < apart) {
        let expected = "dots have a diameter, and do not touch";
        return Err(Error::Invalid { name: "diameter_m", value: diameter_m, expected });
    }
    let (margin, spacing) = (MM * (0.5 * largest + 0.5 * grid.spacing_m()), MM * grid.spacing_m());
    let last = grid.node_m([grid.columns() - 1, grid.rows() - 1]);
    // The longer of two staggered rows.
    let right = if grid.is_staggered() { (2 * grid.columns() - 1) as f64 * spacing } else { MM * last.x };
    let mut page = Page::new(paper, [right + 2.0 * margin, -MM * last.y + 2.0 * margin])?;
    for row in 0..grid.rows() {
        for column in 0..grid.columns() {
            let node = grid.node_m([column, row]);
            let diameter = if column + row == 0 { largest } else { diameter_m };
            page.disc([margin + MM * node.x, margin - MM * node.y], 0.5 * MM * diameter, "black");
        }
    }
    let layout = if grid.is_staggered() { "staggered dots" } else { "dots" };
    let size = format!("{} x {} {layout}, {spacing:.3} mm", grid.columns(), grid.rows());
    Ok(page.finished(&format!("Grid of {size}. Node (0, 0) is the upper left dot; x right, y up.")))
}

/// Coded rings as one page of SVG in millimetre: white discs of a diameter with their rings on black squares, row by row, each with
/// its number below.
///
/// # Errors
/// [`Error::Invalid`] for a diameter that is not positive, and where the targets do not fit the paper.
pub fn print_coded(codes: &[Code], diameter_m: f64, paper: PaperSize) -> Result<String> {
    if !(diameter_m.is_finite() && diameter_m > 0.0) {
        let expected = "a diameter is positive and finite";
        return Err(Error::Invalid { name: "diameter_m", value: diameter_m, expected });
    }
    let radius = 0.5 * MM * diameter_m;
    // Squares of the free ground, and white between them for the numbers.
    let (side, cell) = (2.0 * GROUND * radius, 2.0 * GROUND * radius + 6.0);
    let columns = ((paper.room_mm()[0] / cell) as usize).clamp(1, codes.len().max(1));
    let mut page = Page::new(paper, [columns as f64 * cell, codes.len().div_ceil(columns) as f64 * cell])?;
    for (place, code) in codes.iter().enumerate() {
        let corner = [(place % columns) as f64 * cell + 3.0, (place / columns) as f64 * cell];
        let centre = corner.map(|value| value + 0.5 * side);
        page.rectangle(corner, [side; 2], "black");
        page.disc(centre, radius, "white");
        for sector in (0..code.bits).filter(|sector| code.is_set(*sector)) {
            let angles = [sector, sector + 1].map(|edge| std::f64::consts::TAU * edge as f64 / code.bits as f64);
            page.sector(centre, RING.map(|parts| parts * radius), angles, "white");
        }
        page.text([corner[0], corner[1] + side + 4.0], &code.to_string());
    }
    let sectors = codes.first().map_or(0, |code| code.bits);
    Ok(page.finished(&format!("Coded rings of {sectors} sectors, discs of {:.3} mm.", 2.0 * radius)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::coded::codes;

    /// The numbers of an attribute, in the order of their appearance in lines that begin with `tag`.
    fn numbers(page: &str, tag: &str, attribute: &str) -> Vec<f64> {
        let of_line = |line: &str| line.split_once(&format!(" {attribute}=\""))?.1.split_once('"')?.0.parse().ok();
        page.lines().filter(|line| line.starts_with(tag)).filter_map(of_line).collect()
    }

    #[test]
    fn dots_lie_where_the_grid_says() {
        for grid in [
            CircleGrid::symmetric(10, 8, 0.015).unwrap().with_origin_dot(1.6).unwrap(),
            CircleGrid::asymmetric(4, 11, 0.012).unwrap(),
        ] {
            let page = print_circle_grid(&grid, 0.007, PaperSize::A4).unwrap();
            let [x, y, radii] = ["cx", "cy", "r"].map(|attribute| numbers(&page, "<circle", attribute));
            assert_eq!(x.len(), grid.columns() * grid.rows());
            for k in 0..x.len() {
                let node = grid.node_m([k % grid.columns(), k / grid.columns()]);
                // Four digits of a millimetre.
                assert!((x[k] - x[0] - 1000.0 * node.x).abs() < 1e-3 && (y[0] - y[k] - 1000.0 * node.y).abs() < 1e-3);
                let ratio = if k == 0 { grid.origin_dot().unwrap_or(1.0) } else { 1.0 };
                assert!((radii[k] - 3.5 * ratio).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn fields_meet_at_the_nodes() {
        let board = Checkerboard::new(9, 6, 0.018).unwrap();
        let page = print_checkerboard(&board, PaperSize::A4).unwrap();
        let [x, y, side] = ["x", "y", "width"].map(|attribute| numbers(&page, "<rect x", attribute));
        let fields: Vec<usize> = (0..x.len()).filter(|k| (side[*k] - 18.0).abs() < 1e-3).collect();
        assert_eq!(fields.len(), 35);
        let origin = [x[fields[0]] + 18.0, y[fields[0]] + 18.0];
        for j in 0..6 {
            for i in 0..9 {
                let node = board.node_m([i, j]);
                let place = [origin[0] + 1000.0 * node.x, origin[1] - 1000.0 * node.y];
                let corner = |k: &&usize| (x[**k] - place[0]).abs() < 1e-3 && (y[**k] - place[1]).abs() < 1e-3;
                let ends =
                    |k: &&usize| (x[**k] + 18.0 - place[0]).abs() < 1e-3 && (y[**k] + 18.0 - place[1]).abs() < 1e-3;
                // Of the fields up left and down right of a node both are black or none.
                let (before, behind) = (fields.iter().any(|k| ends(&k)), fields.iter().any(|k| corner(&k)));
                assert!(before == behind && before == ((i + j) % 2 == 0), "{i} {j}");
            }
        }
    }

    #[test]
    fn codes_fill_pages_and_what_does_not_fit_is_refused() {
        let codes = codes(14).unwrap();
        let page = print_coded(&codes[..12], 0.008, PaperSize::A4).unwrap();
        assert_eq!(page.matches("<circle").count(), 12);
        let set: u32 = codes[..12].iter().map(|code| code.word.count_ones()).sum();
        assert_eq!(page.matches("<path").count() as u32, set);
        assert!(
            (numbers(&page, "<rect x", "width").iter().filter(|width| (**width - 100.0).abs() < 1e-9).count()) == 1
        );
        assert!(print_coded(&codes, 0.008, PaperSize::A4).is_err());
        assert!(print_coded(&codes, f64::NAN, PaperSize::A0).is_err() && print_coded(&[], 0.01, PaperSize::A4).is_ok());
        let large = Checkerboard::new(20, 20, 0.05).unwrap();
        assert!(print_checkerboard(&large, PaperSize::A0).is_err());
        let touching = CircleGrid::symmetric(4, 4, 0.01).unwrap();
        assert!(print_circle_grid(&touching, 0.011, PaperSize::A4).is_err());
    }
}
