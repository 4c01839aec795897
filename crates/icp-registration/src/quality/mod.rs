//! What pairs say about a pose, whatever they are pairs of: covariance, and a verdict on degeneracy.
//!
//! Neighbouring pairs share errors (target points used twice, normals from overlapping windows, the same unmodelled
//! bump), so scores are summed per cell of space before they are squared: a cell counts as one observation (a sandwich
//! estimate, clustered). And the noise of normals imitates geometry: on one plane, n noisy normals say something about
//! sliding that is not there. The errors of source and target normals are independent, so the *cross* products of the
//! derivatives along both give the information without that bias, and its scatter between the cells tells whether what
//! is left differs from nothing.

mod cells;
mod directions;
mod motion;
mod verdict;

pub(crate) use cells::Cells;
pub use directions::{Directions, OPEN, SIGNIFICANCE};
pub use motion::{MotionKind, UndeterminedMotion};
pub(crate) use verdict::{Free, ROUNDING, Verdict};

/// Fewest pairs that a pose is told by: three an unknown and two more. Clouds and frames that overlap have hundreds.
pub const FEWEST_PAIRS: usize = 20;
/// Length of a step, in units of the radius, at which a pose stands: far below every noise.
pub const SMALL_STEP: f64 = 1e-5;
