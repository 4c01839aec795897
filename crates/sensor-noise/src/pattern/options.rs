use primitives::PrimitiveOptions;

use crate::{Error, Result};

/// How a fixed pattern is estimated and judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatternOptions {
    /// Which pixels show the wall, and how its plane is fitted. Default: that of [`PrimitiveOptions`].
    pub wall: PrimitiveOptions,
    /// Probability with which a camera without a pattern may pass for one with. Default: 1e-3.
    pub significance: f64,
    /// Least share by which the root mean square of held-out residuals must fall. Default: 0.01.
    pub smallest_gain: f64,
    /// Columns and rows of the blocks that count as independent of each other in the test. Default: 8.
    pub block: usize,
}

impl Default for PatternOptions {
    /// One in a thousand; 1 %; blocks of 8 x 8 pixels.
    fn default() -> Self {
        Self { wall: PrimitiveOptions::default(), significance: 1e-3, smallest_gain: 0.01, block: 8 }
    }
}

impl PatternOptions {
    /// Refuses bad wall options, probabilities and shares beyond 0 to 1, and empty blocks.
    pub(crate) fn validate(&self) -> Result<()> {
        self.wall.validate()?;
        for (name, value) in [("significance", self.significance), ("smallest_gain", self.smallest_gain)] {
            if !(value > 0.0 && value < 1.0) {
                return Err(Error::OutOfDomain { name, value, expected: "a share between 0 and 1" });
            }
        }
        if self.block == 0 {
            return Err(Error::OutOfDomain { name: "block", value: 0.0, expected: "at least one pixel" });
        }
        Ok(())
    }
}
