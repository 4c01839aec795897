//! A calibration network: stations, targets and what was observed between them.

mod choice;
mod contradictions;
mod findings;
mod functional_model;
mod given;
mod methods;
mod outliers;
mod planning;
mod precision;
mod start_values;
mod weakness;

pub use findings::contradiction::{Cause, CauseKind, Contradiction, WorstValue};
pub use findings::outcome::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, CalibrationOutcome, Component, GroupQuality,
    ObservationQuality, TermDecision, TermScore, Verdict,
};
pub use given::model::{
    DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, PassiveImagePoint, Sighting, Station,
};
pub use given::options::{CalibrationOptions, Method, NetworkDatum, TermSelection};
pub use given::outside_image::OutsideImage;
pub use methods::calibrate::{calibrate, calibrate_two_networks};
pub use planning::hold_out::{HoldOut, Prediction, hold_out};
pub use planning::plan::{Candidate, CandidateGrid, PlanOptions, PlanOutcome, plan};
pub use weakness::simulate::{SightingOptions, SimulatedStart, simulate_sightings};
