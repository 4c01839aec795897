//! Whether a network determines its calibration: exact sightings of a design, and the strength of its adjustment.

pub(crate) mod simulate;
pub(crate) mod strength;
