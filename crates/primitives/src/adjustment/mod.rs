//! A surface adjusted to the ranges of pixels along their rays.

mod observation;
mod plane_step;

use adjust::{Adjustment, Covariance, ParameterBlock, Scale, SolveOptions};
use nalgebra::{DMatrix, Vector3};

use self::observation::RangeToPrimitive;
use crate::Result;
use crate::surface::Surface;

/// A pixel of the region with its ray.
pub(crate) struct RegionPixel {
    pub(crate) position: [usize; 2],
    pub(crate) ray: Vector3<f64>,
    pub(crate) observed_m: f64,
    pub(crate) sigma_m: f64,
}

/// An adjusted surface.
pub(crate) struct Adjusted {
    pub(crate) parameters: Vec<f64>,
    pub(crate) covariance: DMatrix<f64>,
    pub(crate) sigma0: f64,
    pub(crate) redundancy: i64,
}

/// The surface nearest to the used pixels, weighted by their sigmas.
pub(crate) fn adjust(pixels: &[RegionPixel], used: &[bool], surface: &Surface, start: &[f64]) -> Result<Adjusted> {
    // What is no plane by its own step is told why by the adjustment.
    if let Some(adjusted) = matches!(surface, Surface::Plane).then(|| plane_step::adjust(pixels, used, start)).flatten()
    {
        return Ok(adjusted);
    }
    let mut network = Adjustment::new();
    let block = network.add_block(ParameterBlock::euclidean(start).named("primitive"));
    let group = network.add_group("ranges");
    for (pixel, _) in pixels.iter().zip(used).filter(|(_, used)| **used) {
        let observation =
            RangeToPrimitive { blocks: [block], surface: *surface, ray: pixel.ray, observed_m: pixel.observed_m };
        network.add_observation(group, observation, &Covariance::from_sigma(pixel.sigma_m))?;
    }
    let solution = network.solve(&SolveOptions::default())?;
    Ok(Adjusted {
        parameters: solution.values(block)?.to_vec(),
        covariance: solution.covariance(block, Scale::Prior)?,
        sigma0: solution.sigma0().unwrap_or(f64::NAN),
        redundancy: solution.redundancy(),
    })
}
