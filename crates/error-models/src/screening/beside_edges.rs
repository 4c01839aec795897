//! What pixels beside edges may be mixed of, as a part of their standard deviation.

use rayon::prelude::*;

use crate::screening::plane_block::{BlockPlane, CORNERS, Inverse, OFFSETS, is_surely_plane};
use crate::{Error, Result};

/// Pixels that a block must have, so that two or more tell whether it is a plane. With 6, four times as many pixels of a wall in
/// which every fifth is missing have no block, and are raised.
const FEWEST_IN_A_BLOCK: usize = 5;

/// Standard deviations along the rays of the points of a frame, raised where a point lies on no plane of its neighbours by what an
/// edge in its pixel may do to its range. `points` stand row by row in the camera's frame (x right, y up, looking along -z), NaN
/// where there is none.
///
/// Where all four blocks of 3 by 3 pixels with the pixel at a corner are planes but for noise, nothing is raised. Else those of
/// them that are planes without the pixel are continued to its ray, and the nearest tells: what its squared distance is beyond the
/// variances of both is added to the variance, for a pixel mixed of two surfaces lies beyond the noise of the nearer one by the
/// error that the mixing makes. Where no block is a plane, the range may be anything between the nearest and the farthest of
/// its neighbours and itself, all alike likely: a twelfth of the square of that span is added. All tests are at the 0.1 % level.
///
/// It is for who reads points, not for weights: a test that goes by it no longer finds that such a point is off. What is real
/// and finer than a block, or bent beyond noise within it, has too large a standard deviation afterwards. Points without a
/// standard deviation stay as they are, and have no part in the blocks of others.
///
/// # Errors
/// [`Error::WrongLength`] where there is not a standard deviation for each point, or the last row is not whole.
///
/// ```
/// use error_models::sigma_beside_edges;
///
/// // A board 8 cm before a wall; a column of pixels sees both.
/// let depth = |col: usize| [2.92, 2.95, 3.0][usize::from(col > 8) + usize::from(col > 9)];
/// let ray = |at: usize| [(at % 20) as f64 * 0.01 - 0.1, (at / 20) as f64 * 0.01 - 0.1, -1.0];
/// let points: Vec<[f64; 3]> = (0..400).map(|at| ray(at).map(|part| depth(at % 20) * part)).collect();
/// let sigma = sigma_beside_edges(&points, &[0.002; 400], 20)?;
/// assert!(sigma[209] > 0.01 && sigma[204] == 0.002);
/// # Ok::<(), error_models::Error>(())
/// ```
pub fn sigma_beside_edges(points: &[[f64; 3]], sigma: &[f32], width: usize) -> Result<Vec<f32>> {
    let expected = points.len();
    if sigma.len() != expected {
        return Err(Error::WrongLength { name: "sigma", found: sigma.len(), expected });
    }
    if width == 0 || !expected.is_multiple_of(width) {
        return Err(Error::WrongLength {
            name: "points",
            found: expected,
            expected: expected.next_multiple_of(width.max(1)),
        });
    }
    let blocks = Blocks::new(points, sigma, width);
    let all = 0..expected;
    let planes: Vec<bool> = all.into_par_iter().map(|at| blocks.is_plane(at % width, at / width)).collect();
    let raised = sigma.par_iter().enumerate().map(|(at, sigma)| blocks.raised(at, &planes).unwrap_or(*sigma));
    Ok(raised.collect())
}

/// A frame, seen in blocks of three by three points.
struct Blocks {
    width: usize,
    height: usize,
    /// Inverse distances along the camera's axis with their variances, NaN where a pixel has no range or no standard deviation: of
    /// planes they are straight from pixel to pixel, whatever the field of view; a lens bends them by some ten thousandths of what
    /// they change by.
    inverse: Vec<Inverse>,
    /// Ranges over distances along the axis.
    obliquity: Vec<f64>,
}

impl Blocks {
    fn new(points: &[[f64; 3]], sigma: &[f32], width: usize) -> Self {
        let obliquity: Vec<f64> = points.iter().map(|[x, y, z]| (x * x + y * y + z * z).sqrt() / -z).collect();
        let inverse = points.par_iter().zip(sigma).zip(&obliquity).map(|(([_, _, z], sigma), obliquity)| {
            let (distance, sigma) = (-z, f64::from(*sigma) / obliquity);
            let is_known = distance > 0.0 && distance.is_finite() && sigma > 0.0 && sigma.is_finite();
            if is_known { Inverse::of([distance, sigma * sigma]) } else { Inverse::NONE }
        });
        Self { width, height: points.len() / width, inverse: inverse.collect(), obliquity }
    }

    /// Place of the pixel a step away.
    fn beside(&self, col: usize, row: usize, [dx, dy]: [isize; 2]) -> Option<usize> {
        let (col, row) = (col.checked_add_signed(dx)?, row.checked_add_signed(dy)?);
        (col < self.width && row < self.height).then_some(row * self.width + col)
    }

    fn at(&self, place: usize) -> Option<Inverse> {
        Some(self.inverse[place]).filter(|inverse| !inverse.value.is_nan())
    }

    /// The block about a pixel, without one of its pixels if that is asked for.
    fn block(&self, centre: usize, without: Option<usize>) -> [Option<Inverse>; 9] {
        let (col, row) = (centre % self.width, centre / self.width);
        OFFSETS.map(|step| self.at(self.beside(col, row, step).filter(|place| without != Some(*place))?))
    }

    fn is_plane(&self, col: usize, row: usize) -> bool {
        let inside = (1..self.width - 1).contains(&col) && (1..self.height - 1).contains(&row);
        if inside {
            let first = (row - 1) * self.width + col - 1;
            let lines = [0, 1, 2].map(|line| &self.inverse[first + line * self.width..][..3]);
            if is_surely_plane(&[0, 1, 2, 3, 4, 5, 6, 7, 8].map(|at| lines[at / 3][at % 3])) {
                return true;
            }
        }
        self.plane(row * self.width + col, None).is_some()
    }

    fn plane(&self, centre: usize, without: Option<usize>) -> Option<BlockPlane> {
        let block = self.block(centre, without);
        let plane = (block.iter().flatten().count() >= FEWEST_IN_A_BLOCK).then(|| BlockPlane::of(&block))??;
        plane.is_plane().then_some(plane)
    }

    /// The standard deviation of a pixel with what an edge in it may do; `None` where it stays as it is.
    fn raised(&self, place: usize, planes: &[bool]) -> Option<f32> {
        let (col, row) = (place % self.width, place / self.width);
        let pixel = self.at(place)?;
        let blocks = || CORNERS.into_iter().filter_map(|step| Some((step, self.beside(col, row, step)?)));
        if blocks().all(|(_, centre)| planes[centre]) {
            return None;
        }
        let distance = 1.0 / pixel.value;
        let variance = pixel.variance * distance.powi(4);
        let further = self.off_the_nearest_plane(place, pixel, blocks());
        let further = further.unwrap_or_else(|| self.span(col, row, distance).powi(2) / 12.0);
        (further > 0.0).then(|| ((variance + further).sqrt() * self.obliquity[place]) as f32)
    }

    /// What the squared distance to the nearest plane beside the pixel is beyond both variances, square metre along the axis.
    fn off_the_nearest_plane(
        &self,
        place: usize,
        pixel: Inverse,
        blocks: impl Iterator<Item = ([isize; 2], usize)>,
    ) -> Option<f64> {
        let distances = blocks.filter_map(|(step, centre)| {
            let continued = self.plane(centre, Some(place))?.at(step.map(|part| -part));
            let variance = pixel.variance + continued.variance;
            (continued.value > 0.0).then(|| ((pixel.value - continued.value).powi(2), variance, continued.value))
        });
        let (squared, variance, continued) = distances.min_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))?;
        // A difference of inverse distances is one of distances over the product of both.
        Some((squared - variance).max(0.0) / (pixel.value * continued).powi(2))
    }

    /// Span of the distances of a pixel and those beside it, metre along the axis.
    fn span(&self, col: usize, row: usize, distance: f64) -> f64 {
        let beside = OFFSETS.into_iter().filter_map(|step| Some(1.0 / self.at(self.beside(col, row, step)?)?.value));
        let [least, most] = beside.fold([distance; 2], |[least, most], of| [least.min(of), most.max(of)]);
        most - least
    }
}
