use nalgebra::DMatrix;

use crate::{Primitive, PrimitiveKind};

/// A primitive fitted to the ranges of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct PrimitiveFit {
    /// Which primitive.
    pub kind: PrimitiveKind,
    /// The primitive in the camera frame.
    pub primitive: Primitive,
    /// Adjusted parameters: `n / d` of a plane; centre and radius; two slopes, two coordinates and radius of a cylinder.
    pub parameters: Vec<f64>,
    /// Their covariance, from the pixels' own sigmas (prior-scaled).
    pub covariance: DMatrix<f64>,
    /// Standard deviation of unit weight: 1 if the pixels scatter as their sigmas say.
    pub sigma0: f64,
    /// Pixels used less parameters.
    pub redundancy: i64,
    /// Probability of so large a sigma0 or a larger one, if pixels scatter as their sigmas say.
    pub sigma0_probability: f64,
    /// Root mean square of what residuals of neighbours have in common, in sigmas of a pixel: what is not random, and
    /// averaging does not reduce. Zero where it is not significant.
    pub systematic_sigmas: f64,
    /// The pixels of the region.
    pub pixels: Vec<FittedPixel>,
    /// Root mean square sigma of the used pixels over that of the ranges modelled there: how much averaging in space
    /// gains against random errors.
    pub gain: f64,
}

/// One pixel of the region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedPixel {
    /// Column and row.
    pub position: [usize; 2],
    /// Range observed, metre.
    pub observed_m: f64,
    /// Its standard deviation, metre.
    pub sigma_m: f64,
    /// Range of the primitive, metre.
    pub modelled_m: f64,
    /// Its standard deviation, metre.
    pub modelled_sigma_m: f64,
    /// Whether the pixel took part; the others belong to something else.
    pub used: bool,
}

impl PrimitiveFit {
    /// Share of the region's pixels that belong to something else.
    pub fn outlier_share(&self) -> f64 {
        let used = self.pixels.iter().filter(|pixel| pixel.used).count();
        1.0 - used as f64 / self.pixels.len() as f64
    }
}
