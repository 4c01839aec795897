//! A plane adjusted to ranges along their rays: three unknowns, whose normal equations are summed up.
//!
//! Curved primitives go through `adjust`, which builds an observation of each pixel: of 300,000 pixels (640 x 480) that takes
//! most of a second for each choice of pixels, this takes a few milliseconds. Captures of walls hold thousands of such frames.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::{Adjusted, RegionPixel};

/// Rounds within which the steps become as small as rounding: from a robust start three to five are taken.
const MAX_ROUNDS: usize = 30;
/// Steps of this share of the parameters are rounding.
const SETTLED: f64 = 1e-13;

/// The plane nearest to the used pixels, weighted by their sigmas; `None` where they do not determine one.
pub(super) fn adjust(pixels: &[RegionPixel], used: &[bool], start: &[f64]) -> Option<Adjusted> {
    let used = || pixels.iter().zip(used).filter(|(_, used)| **used).map(|(pixel, _)| pixel);
    let mut m = Vector3::from_column_slice(start.get(..3)?);
    for _ in 0..MAX_ROUNDS {
        let sums = Sums::new(used(), &m)?;
        let factor = sums.normal().cholesky()?;
        let right = Vector3::from(sums.right);
        let step = factor.solve(&right);
        m += step;
        let fall = right.dot(&step);
        if step.norm() <= SETTLED * m.norm() || fall <= f64::EPSILON * sums.squares {
            let redundancy = sums.count as i64 - 3;
            return Some(Adjusted {
                parameters: m.as_slice().to_vec(),
                covariance: DMatrix::from_column_slice(3, 3, factor.inverse().as_slice()),
                sigma0: if redundancy > 0 { ((sums.squares - fall) / redundancy as f64).sqrt() } else { f64::NAN },
                redundancy,
            });
        }
    }
    None
}

/// What is summed up over the pixels: the upper triangle of the normal matrix by rows, the right side, and the weighted
/// squares of the residuals.
#[derive(Default)]
struct Sums {
    upper: [f64; 6],
    right: [f64; 3],
    squares: f64,
    count: usize,
}

impl Sums {
    /// `None` where a ray misses the plane.
    fn new<'a>(pixels: impl Iterator<Item = &'a RegionPixel>, m: &Vector3<f64>) -> Option<Self> {
        let mut sums = Self::default();
        for pixel in pixels {
            let slope = m.dot(&pixel.ray);
            let range_m = slope.recip();
            if !(slope > 0.0 && range_m.is_finite()) {
                return None;
            }
            // dρ = −ρ² uᵀ dm
            let [x, y, z] = (pixel.ray * (-range_m * range_m)).into();
            let weight = (pixel.sigma_m * pixel.sigma_m).recip();
            let residual = pixel.observed_m - range_m;
            for (sum, product) in sums.upper.iter_mut().zip([x * x, x * y, x * z, y * y, y * z, z * z]) {
                *sum += weight * product;
            }
            for (sum, own) in sums.right.iter_mut().zip([x, y, z]) {
                *sum += weight * residual * own;
            }
            sums.squares += weight * residual * residual;
            sums.count += 1;
        }
        Some(sums)
    }

    fn normal(&self) -> Matrix3<f64> {
        let [xx, xy, xz, yy, yz, zz] = self.upper;
        Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}
