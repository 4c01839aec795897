use crate::{DifferenceOptions, Error, Result};

/// How a primitive is fitted to a region of a frame, and what is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrimitiveOptions {
    /// The region and its pixels. Default: as for [`DifferenceOptions`], with angles of incidence up to 75°, so that the
    /// rim of a round object has its say.
    pub pixels: DifferenceOptions,
    /// Pixels further from the primitive than so many standard deviations (or robust scales, where these are larger)
    /// belong to something else. Default 4.
    pub rejection_sigmas: f64,
    /// Largest share of such pixels. Default 0.4.
    pub largest_outlier_share: f64,
    /// Largest root mean square of what neighbouring residuals have in common, in standard deviations of a pixel: more
    /// is another shape. Default 1.
    pub largest_systematic_sigmas: f64,
    /// Largest standard deviation of a radius in parts of itself, and of a direction in radian. Default 0.1.
    pub largest_uncertainty: f64,
    /// Seed of the random subsets of the start. Same seed, same bits.
    pub seed: u64,
}

impl Default for PrimitiveOptions {
    fn default() -> Self {
        let pixels = DifferenceOptions { largest_incidence_rad: 75.0_f64.to_radians(), ..DifferenceOptions::default() };
        Self {
            pixels,
            rejection_sigmas: 4.0,
            largest_outlier_share: 0.4,
            largest_systematic_sigmas: 1.0,
            largest_uncertainty: 0.1,
            seed: 1,
        }
    }
}

impl PrimitiveOptions {
    /// Refuses bad pixel options and limits that are not positive.
    pub fn validate(&self) -> Result<()> {
        self.pixels.validate()?;
        for (name, value) in [
            ("rejection_sigmas", self.rejection_sigmas),
            ("largest_outlier_share", self.largest_outlier_share),
            ("largest_systematic_sigmas", self.largest_systematic_sigmas),
            ("largest_uncertainty", self.largest_uncertainty),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::OutOfDomain { name, value, expected: "a positive limit" });
            }
        }
        Ok(())
    }
}
