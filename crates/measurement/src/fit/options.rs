use crate::{Error, Result};

/// How a fit decides what belongs to the shape and what speaks against it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitOptions {
    /// Probability that any good point of a region is left out, all its points together. Default 0.05; smaller keeps more of what
    /// belongs to something else.
    pub rejection_level: f64,
    /// Probability that points which scatter as stated are said to scatter more. Default 0.01: one doubt in a hundred good
    /// regions.
    pub doubt_level: f64,
    /// Seed of the random subsets that start values come from. Default 1.
    pub seed: u64,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { rejection_level: 0.05, doubt_level: 0.01, seed: 1 }
    }
}

impl FitOptions {
    pub(crate) fn validate(&self) -> Result<()> {
        for (name, value) in [("rejection_level", self.rejection_level), ("doubt_level", self.doubt_level)] {
            if !(value > 0.0 && value < 1.0) {
                return Err(Error::OutOfDomain { name, value, expected: "a probability between 0 and 1" });
            }
        }
        Ok(())
    }
}
