//! Whether a network determines its calibration: exact sightings of a design, and the strength of its adjustment.

pub(crate) mod simulate;
pub(crate) mod strength;

pub use simulate::{SightingOptions, SimulatedStart, exact_sightings, planned_sightings, simulate_sightings};
pub use strength::{Motions, Strength, combination, weakest};
