//! A calibration network: stations, targets and what was observed between them.

mod model;
mod options;
mod outcome;

pub use model::{
    DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, PassiveImagePoint, Sighting, Station,
};
pub use options::{CalibrationOptions, Method, NetworkDatum, TermSelection};
pub use outcome::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, CalibrationOutcome, Component, GroupQuality,
    ObservationQuality, TermDecision, Verdict,
};
