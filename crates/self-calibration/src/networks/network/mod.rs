//! A calibration network: stations, targets and what was observed between them.

mod auto_terms;
mod builder;
mod calibrate;
mod catalogue;
mod causes;
mod check;
mod combine;
mod contradiction;
mod control_test;
mod equations;
mod explain;
mod global_tests;
mod hold_out;
mod hyperbola;
mod hyperbola_steps;
mod image_model;
mod judgement;
mod misfit;
mod model;
mod options;
mod outcome;
mod outside_image;
mod plan;
mod point_sigma;
mod problem;
mod quality;
mod range_step;
mod reference;
mod rejection;
mod rejection_words;
mod report;
mod robust_pose;
mod selection;
mod settle;
mod simulate;
mod start;
mod start_calibration;
mod start_finder;
mod strength;
mod suspicion;
mod term_priors;
mod term_words;
mod terms;

pub(crate) use misfit::median;

pub use calibrate::{calibrate, calibrate_two_networks};
pub use contradiction::{Cause, CauseKind, Contradiction, WorstValue};
pub use hold_out::{HoldOut, Prediction, hold_out};
pub use model::{
    DistanceEnd, KnownDistance, Network, NetworkTarget, PassiveCamera, PassiveImagePoint, Sighting, Station,
};
pub use options::{CalibrationOptions, Method, NetworkDatum, TermSelection};
pub use outcome::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, CalibrationOutcome, Component, GroupQuality,
    ObservationQuality, TermDecision, TermScore, Verdict,
};
pub use outside_image::OutsideImage;
pub use plan::{Candidate, CandidateGrid, PlanOptions, PlanOutcome, plan};
pub use simulate::{SightingOptions, SimulatedStart, simulate_sightings};
