//! Whether a block of three by three ranges is a plane but for its noise.

use nalgebra::{Matrix3, Vector3};

/// The misfit that one of a thousand true planes exceeds: the quantile 0.999 of chi-squared with 9 - 3 = 6 degrees of freedom.
/// With 0.99 instead there are more false flags in rooms, up to 1.5 times as many; with 0.99996 fewer, and fewer right ones.
const LARGEST_MISFIT: f64 = 22.46;

/// Columns and rows of the block beside its centre.
const OFFSETS: [[isize; 2]; 9] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [0, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// Whether the pixel is a corner of a block of nine pixels that is a plane. `range` gives the range and its variance at a step
/// of columns and rows from the pixel, `None` where there is none.
///
/// Not a pixel in the middle of a block: there a mixed one lies halfway between the surfaces at its sides, and the three are
/// as straight as a plane. From a corner no edge runs through the middle of the block but the diagonal one, across which a
/// block has five lines of pixels, two of either surface.
pub(crate) fn is_corner_of_a_plane(range: impl Fn(isize, isize) -> Option<[f64; 2]>) -> bool {
    [[-1, -1], [1, -1], [-1, 1], [1, 1]].iter().any(|[x, y]| is_plane(|dx, dy| range(x + dx, y + dy)))
}

/// A plane is straight in `1/ρ` from ray to ray (but for the squared angle between them, 0.3 per mille of the range at a
/// degree). Its misfit is weighted by the variances.
fn is_plane(range: impl Fn(isize, isize) -> Option<[f64; 2]>) -> bool {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    let mut squares = 0.0;
    for [dx, dy] in OFFSETS {
        let Some([range, variance]) = range(dx, dy) else { return false };
        let weight = range.powi(4) / variance;
        let (at, inverse) = (Vector3::new(1.0, dx as f64, dy as f64), 1.0 / range);
        normal += weight * at * at.transpose();
        right += weight * inverse * at;
        squares += weight * inverse * inverse;
    }
    normal.cholesky().is_some_and(|normal| squares - right.dot(&normal.solve(&right)) <= LARGEST_MISFIT)
}
