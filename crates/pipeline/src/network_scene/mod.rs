//! Calibration networks as RON data: where targets and stations stand, what is true, how it is observed.

mod check;
mod simulate;
mod spec;

pub use check::{MOST_SIGHTINGS, MOST_TARGETS};
pub use simulate::simulate_network;
pub(crate) use simulate::{START, simulate_into};
pub use spec::{FieldSpec, NetworkScene, PassiveSpec, SceneStation, SceneTarget, SightingSpec};
