//! A first plane through the points of a capture, whatever else is in the picture.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::by_planes::planes_pixels::PlanePixels;
use crate::{Plane, Result};

/// Rounds of new weights; least absolute values settle in some ten.
const ROUNDS: usize = 20;

/// Points that are enough for a start.
const FEW: usize = 4000;

/// Misfits below this share of the distance get no larger weight.
const SMALLEST_MISFIT: f64 = 1e-4;

/// Smallest over largest eigenvalue below which points lie on a line.
const ON_A_LINE: f64 = 1e-9;

/// The plane of least absolute misfit, in the camera frame: `mᵀ P = 1` with `m = n / d`, linear in m. No plane that a
/// camera sees goes through its perspective centre, so d is not zero. `None` where the points do not span one.
pub(crate) fn plane_through(pixels: &PlanePixels) -> Result<Option<Plane>> {
    let points: Vec<_> = pixels.thinned(FEW).points().collect();
    let mut weights = vec![1.0; points.len()];
    let mut direction = Vector3::zeros();
    for _ in 0..ROUNDS {
        let weighted = || points.iter().zip(&weights);
        let normal: Matrix3<f64> = weighted().map(|(point, weight)| point * point.transpose() * *weight).sum();
        let right: Vector3<f64> = weighted().map(|(point, weight)| point * *weight).sum();
        let eigenvalues = normal.symmetric_eigenvalues();
        let solved = normal.cholesky().filter(|_| eigenvalues.min() > ON_A_LINE * eigenvalues.max());
        let Some(factor) = solved else { return Ok(None) };
        direction = factor.solve(&right);
        for (weight, point) in weights.iter_mut().zip(&points) {
            *weight = (direction.dot(point) - 1.0).abs().max(SMALLEST_MISFIT).recip();
        }
    }
    let foot = direction / direction.norm_squared();
    Ok(Some(Plane::new(&direction, &Point3::from(foot))?))
}
