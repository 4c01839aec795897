//! A calibration network: stations, targets and what was observed between them.

mod auto_terms;
mod builder;
mod calibrate;
mod check;
mod combine;
mod equations;
mod hyperbola;
mod image_model;
mod model;
mod options;
mod outcome;
mod plan;
mod point_sigma;
mod problem;
mod quality;
mod range_step;
mod reference;
mod rejection;
mod report;
mod selection;
mod simulate;
mod start;
mod strength;
mod term_words;
mod terms;

pub use calibrate::{calibrate, calibrate_two_networks};
pub use model::{
    DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, PassiveImagePoint, Sighting, Station,
};
pub use options::{CalibrationOptions, Method, NetworkDatum, TermSelection};
pub use outcome::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, CalibrationOutcome, Component, GroupQuality,
    ObservationQuality, TermDecision, Verdict,
};
pub use plan::{Candidate, CandidateGrid, PlanOptions, PlanOutcome, plan};
pub use simulate::{SightingOptions, SimulatedStart, simulate_sightings};
