//! Calibration networks as RON data: where targets and stations stand, what is true, how it is observed.

pub(crate) mod check;
pub(crate) mod simulate;
pub(crate) mod spec;

pub use check::{MOST_SIGHTINGS, MOST_TARGETS};
pub use simulate::simulate_network;
pub use spec::{FieldSpec, NetworkScene, PassiveSpec, SceneStation, SceneTarget, SightingSpec};

pub(crate) use simulate::{START, simulate_into};
