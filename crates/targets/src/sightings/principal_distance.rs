//! A first principal distance from the perspective of boards, where no camera is known.

use nalgebra::Vector2;
use range_image::ImageFormat;
use statistics::mad_scale;

use crate::grid::homography::Homography;

/// Relative deviation of the inverse square of the principal distance above which boards do not tell it: at a half the
/// distance is known to a quarter, which is enough for start values of an adjustment.
const LARGEST_DEVIATION: f64 = 0.5;

/// The principal distance, in pixels, of a camera with square pixels, its principal point in the centre of the image and
/// no distortion, from boards seen in perspective; `None` where they do not tell it: all of them frontal, or none. A board
/// is a list of points: in its plane (metre, or any unit), and where they were seen (col, row).
///
/// The columns of the map from a board onto the image are the images of two directions at right angles and of one length
/// `[Zhang2000]`: two equations a board, linear in the inverse square of the distance.
pub fn principal_distance_px(format: &ImageFormat, boards: &[Vec<([f64; 2], [f64; 2])>]) -> Option<f64> {
    let centre = Vector2::new(format.width as f64 - 1.0, format.height as f64 - 1.0) / 2.0;
    // Coordinates of about one keep the equations on one scale.
    let unit = centre.norm();
    let equations: Vec<[f64; 2]> = boards
        .iter()
        .filter_map(|board| {
            let pairs =
                board.iter().map(|(place, pixel)| (Vector2::from(*place), (Vector2::from(*pixel) - centre) / unit));
            let map = Homography::fit(&pairs.collect::<Vec<_>>())?;
            let [first, second] = map.directions();
            let size = first.norm() * second.norm();
            let mixed = [first.xy().dot(&second.xy()) / size, first.z * second.z / size];
            let lengths = [
                (first.xy().norm_squared() - second.xy().norm_squared()) / size,
                (first.z * first.z - second.z * second.z) / size,
            ];
            Some([mixed, lengths])
        })
        .flatten()
        .collect();
    let squares: f64 = equations.iter().map(|[a, _]| a * a).sum();
    let inverse_square = least_absolute(equations.clone())?;
    let mut misfits: Vec<f64> = equations.iter().map(|[a, b]| (a * inverse_square + b).abs()).collect();
    let deviation = mad_scale(&mut misfits) / squares.sqrt();
    (inverse_square > 0.0 && deviation < LARGEST_DEVIATION * inverse_square).then(|| unit / inverse_square.sqrt())
}

/// The `x` of the least sum of |a x + b|, on which a board that was mistaken has little hold: a weighted median.
fn least_absolute(mut equations: Vec<[f64; 2]>) -> Option<f64> {
    equations.retain(|[a, b]| a.abs() > 0.0 && a.is_finite() && b.is_finite());
    equations.sort_by(|x, y| (-x[1] / x[0]).total_cmp(&(-y[1] / y[0])));
    let half = equations.iter().map(|[a, _]| a.abs()).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let middle = equations.iter().find(|[a, _]| {
        sum += a.abs();
        sum >= half
    });
    middle.map(|[a, b]| -b / a)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    /// A board of 6 x 4 nodes, turned by `angle` about a slanted axis, through a distance of 150 pixels.
    fn board(angle: f64) -> Vec<([f64; 2], [f64; 2])> {
        let turn = Rotation3::from_scaled_axis(Vector3::new(1.0, 0.4, 0.2).normalize() * angle);
        let node = |k: u32| [0.1 * f64::from(k % 6), 0.1 * f64::from(k / 6)];
        let seen = |[x, y]: [f64; 2]| {
            let place = turn * Vector3::new(x - 0.25, y - 0.15, 0.0) + Vector3::new(0.1, 0.05, 1.5);
            [87.5 + 150.0 * place.x / place.z, 71.5 + 150.0 * place.y / place.z]
        };
        (0..24).map(node).map(|place| (place, seen(place))).collect()
    }

    #[test]
    fn tilted_boards_tell_it_and_frontal_ones_do_not() {
        let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
        let found = principal_distance_px(&format, &[board(0.6), board(-0.4)]).unwrap();
        assert!((found - 150.0).abs() < 1e-6, "{found}");
        let mut mistaken = board(0.5);
        mistaken.rotate_left(7);
        let places = board(0.5);
        let mistaken: Vec<_> = mistaken.iter().zip(&places).map(|((_, pixel), (place, _))| (*place, *pixel)).collect();
        let boards = [board(0.6), board(-0.4), mistaken, board(0.7), board(-0.6)];
        let found = principal_distance_px(&format, &boards).unwrap();
        assert!((found - 150.0).abs() < 1.0, "{found}");
        assert!(principal_distance_px(&format, &[board(0.0)]).is_none());
        assert!(principal_distance_px(&format, &[]).is_none());
    }
}
