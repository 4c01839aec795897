//! The range offset of each pixel (Sect. 4.5) from walls, and whether taking it off raises the precision.

mod estimate;
mod held_out;
mod mean;
mod options;
mod residuals;

pub use estimate::{PatternEstimate, PatternEstimator, WallCapture, WallQuality, estimate_fixed_pattern};
pub use held_out::{HeldOutTest, PatternSplit, PatternVerdict};
pub use options::PatternOptions;
