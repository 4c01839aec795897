use crate::{DifferenceOptions, Error, Result};

/// How a primitive is fitted to a region of a frame, and what is refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrimitiveOptions {
    /// The region and its pixels. Default: as for [`DifferenceOptions`], with angles of incidence up to 75°, so that the
    /// rim of a round object has its say.
    pub pixels: DifferenceOptions,
    /// Largest root mean square of what neighbouring residuals have in common, in standard deviations of a pixel: more
    /// is another shape. Default 1.
    pub largest_systematic_sigmas: f64,
    /// Seed of the random subsets of the start. Same seed, same bits. Default: 1.
    pub seed: u64,
}

impl Default for PrimitiveOptions {
    fn default() -> Self {
        let pixels = DifferenceOptions { largest_incidence_rad: 75.0_f64.to_radians(), ..DifferenceOptions::default() };
        Self { pixels, largest_systematic_sigmas: 1.0, seed: 1 }
    }
}

impl PrimitiveOptions {
    /// Refuses bad pixel options and a limit that is not positive.
    pub fn validate(&self) -> Result<()> {
        self.pixels.validate()?;
        let value = self.largest_systematic_sigmas;
        if value.is_finite() && value > 0.0 {
            return Ok(());
        }
        Err(Error::OutOfDomain { name: "largest_systematic_sigmas", value, expected: "a positive limit" })
    }
}
