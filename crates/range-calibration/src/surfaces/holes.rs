//! Holes of single pixels: where planes are fitted, neighbours stand in for them.
//!
//! A window of seven pixels a side shows a plane where nine tenths of it lie on one surface. With a fifth of the pixels missing here and
//! there no window does, though none of them is at an edge: all patches would be gone, and with them the registration.

use nalgebra::Vector3;

/// Fewest of eight neighbours on one surface that stand in for a pixel: with four on one side it is at the rim of a larger hole.
const FEWEST: usize = 5;

/// The points of a frame with each missing one replaced by the mean of its neighbours, where enough of these lie on one surface: their
/// ranges differ from their median by at most `max_relative_jump` of it.
pub(super) fn filled(points: &[[f64; 3]], width: usize, height: usize, max_relative_jump: f64) -> Vec<[f64; 3]> {
    let missing = |point: &[f64; 3]| point[0].is_nan();
    let mut whole = points.to_vec();
    for (index, point) in whole.iter_mut().enumerate().filter(|(_, point)| missing(point)) {
        let (col, row) = (index % width, index / width);
        let (rows, cols) = (row.saturating_sub(1)..(row + 2).min(height), col.saturating_sub(1)..(col + 2).min(width));
        let around = rows.flat_map(|r| cols.clone().map(move |c| r * width + c));
        let known = around.map(|at| points[at]).filter(|point| !missing(point)).map(Vector3::from);
        let neighbours: Vec<Vector3<f64>> = known.collect();
        if neighbours.len() < FEWEST {
            continue;
        }
        let mut ranges: Vec<f64> = neighbours.iter().map(Vector3::norm).collect();
        let median = statistics::upper_median(&mut ranges);
        let on_surface = neighbours.iter().filter(|point| (point.norm() - median).abs() <= max_relative_jump * median);
        let (sum, count) = on_surface.fold((Vector3::zeros(), 0), |(sum, count), point| (sum + point, count + 1));
        if count >= FEWEST {
            *point = (sum / count as f64).into();
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_in_a_wall_is_filled_and_the_rim_of_a_large_one_is_not() {
        let (width, height) = (9, 7);
        let mut points: Vec<[f64; 3]> =
            (0..width * height).map(|at| [0.01 * (at % width) as f64, 0.01 * (at / width) as f64, -2.0]).collect();
        let nan = [f64::NAN; 3];
        points[2 * width + 2] = nan;
        for row in 0..height {
            points[row * width + 6] = nan;
            points[row * width + 7] = nan;
        }
        let whole = filled(&points, width, height, 0.03);
        // The mean of a ring is its middle: exact up to rounding.
        assert!(
            whole[2 * width + 2]
                .iter()
                .zip([0.02, 0.02, -2.0])
                .all(|(found, expected)| (found - expected).abs() < 1e-12)
        );
        assert!((0..height).all(|row| whole[row * width + 6][0].is_nan() && whole[row * width + 7][0].is_nan()));
    }
}
